"""The least shaking force by Optuna: suggestions are asked for, runs are told; an error of the scene is a failed trial."""

from __future__ import annotations

import odyn
import optuna
import shaking


def least(trials: int = 60, seed: int = 1) -> optuna.Study:
    """The study with all trials."""
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    model = shaking.compressor()
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=seed))
    for _ in range(trials):
        trial = study.ask()
        pairs = zip(shaking.KEYS, shaking.BOUNDS, strict=True)
        values = [trial.suggest_float(key, *bounds) for key, bounds in pairs]
        try:
            study.tell(trial, shaking.shaking(model, values))
        except odyn.Error:
            study.tell(trial, state=optuna.trial.TrialState.FAIL)
    return study


if __name__ == "__main__":
    found = least()
    print(f"{found.best_params}: {found.best_value:.4f} N after {len(found.trials)} trials")
