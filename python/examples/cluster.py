"""A study of the compressor on a cluster that loses a worker, and what must hold then: `python cluster.py FOLDER [--points 10000]`.

Three worker processes of Dask do the shards, and one of them is killed when half of the shards are there. The table and the series have
the bytes that one job gives, and so have shards that were interrupted, killed and continued by hand; one row is repeated by
`odyn run`. What it took is printed: times, and the largest resident memory of the program and of each worker with its children.
"""

from __future__ import annotations

import argparse
import csv
import os
import signal
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import odyn
from odyn._program import PROGRAM

SCENE = Path(__file__).resolve().parents[2] / "scenes" / "compressor.toml"
SERIES = {"series": ["x_p", "theta"], "samples": 20}


def points(count: int) -> list[dict[str, str]]:
    """Lengths of the rod and masses of the piston, none of them twice."""
    return [{"rod.length": f"{40 + 10 * k / count:.6g} mm", "piston.mass": f"{30 + k % 21} g"} for k in range(count)]


def resident(pid: int) -> int:
    """Resident memory of a process, bytes; 0 where it has ended."""
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, IndexError):
        return 0


def children(pid: int) -> list[int]:
    """Those of all threads of a process."""
    found: list[int] = []
    for file in Path(f"/proc/{pid}/task").glob("*/children"):
        try:
            found += map(int, file.read_text().split())
        except OSError:
            continue
    return found


class Watch:
    """Looks at the memory of processes and their children while something else is done."""

    def __init__(self) -> None:
        self.pids: list[int] = []
        self.samples: list[tuple[float, int, int]] = []
        """Times, the largest process, the largest of its children; bytes."""

    @contextmanager
    def __call__(self) -> Iterator[None]:
        ended = threading.Event()

        def look() -> None:
            while not ended.wait(0.05):
                for pid in self.pids:
                    below = max(map(resident, children(pid)), default=0)
                    self.samples.append((time.monotonic(), resident(pid), below))

        watcher = threading.Thread(target=look, daemon=True)
        watcher.start()
        try:
            yield
        finally:
            ended.set()
            watcher.join()

    def report(self, what: str) -> None:
        """The largest of the first and of the last quarter of the time."""
        begin, end = self.samples[0][0], self.samples[-1][0]

        def largest(share: float, until: float, which: int) -> float:
            own = [one[which] for one in self.samples if share <= (one[0] - begin) / (end - begin or 1) <= until]
            return max(own, default=0) / 2**20

        process, below = ([largest(a, b, which) for a, b in ((0, 0.25), (0.75, 1))] for which in (1, 2))
        print(f"{what}: {process[0]:.0f} MB in the first quarter, {process[1]:.0f} MB in the last")
        print(f"  the program that it runs: {below[0]:.0f} MB and {below[1]:.0f} MB")


def same(one: odyn.Study, other: odyn.Study, what: str) -> None:
    """That table and series have the same bytes."""
    assert one.path.read_bytes() == other.path.read_bytes(), f"{what}: the table"
    assert one.series.path.read_bytes() == other.series.path.read_bytes(), f"{what}: the series"
    print(f"{what}: same bytes")


def on_a_cluster(model: odyn.Model, rows: list[dict[str, str]], output: Path, shards: int, workers: int) -> odyn.Study:
    """The study on workers, one of which is killed at half."""
    from dask.distributed import Client, LocalCluster

    output.mkdir(parents=True)
    watch = Watch()
    with (
        LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        watch.pids = [one.process.process.pid for one in cluster.workers.values()]
        victim = watch.pids[0]

        def kill() -> None:
            # At half, and in the middle of a shard.
            while len(list(output.glob("part-*.csv"))) < shards // 2 or not children(victim):
                time.sleep(0.002)
            os.kill(victim, signal.SIGKILL)
            print("killed a worker when", len(list(output.glob("part-*.csv"))), "of", shards, "shards were there")

        killer = threading.Thread(target=kill, daemon=True)
        killer.start()
        begin = time.monotonic()
        with watch():
            found = odyn.study(model, rows, output=output, client=client, shards=shards, **SERIES)
        print(f"{workers} workers: {time.monotonic() - begin:.1f} s")
        killer.join(10)
        assert not killer.is_alive(), "no worker was killed"
    watch.report("a worker")
    return found


def by_hand(model: odyn.Model, rows: list[dict[str, str]], output: Path, shards: int) -> odyn.Study:
    """The shards as commands, each ended twice on its way: by an interrupt and by a kill, and continued."""
    output.mkdir(parents=True)
    table = output / "points.csv"
    with table.open("w", newline="") as file:
        csv.writer(file).writerows([rows[0].keys(), *(row.values() for row in rows)])
    ended = 0
    for number in range(1, shards + 1):
        command = [PROGRAM, "study", SCENE, "--csv", table, "-o", output, "--resume", "--jobs", "1"]
        command += [f"--set={one}" for one in model.overrides]
        command += [f"--series={','.join(SERIES['series'])}", f"--samples={SERIES['samples']}", f"--shard={number}/{shards}"]
        size = len(rows) // shards
        for code in (signal.SIGINT, signal.SIGKILL, None):
            run = subprocess.Popen([str(part) for part in command], stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
            assert run.stderr is not None
            # A line for each run.
            for heard, _ in enumerate(run.stderr, 1):
                if code is not None and heard == size // 4:
                    run.send_signal(code)
                    ended += 1
                    break
            run.stderr.read()
            run.wait()
    print(f"shards by hand: ended {ended} times and continued")
    return odyn.merge(output)


def repeated(study: odyn.Study, model: odyn.Model, row: int, folder: Path) -> None:
    """A row by `odyn run`: its last values and its series, bit for bit."""
    place = study.columns.index("status")
    values = dict(zip(study.columns[1:place], study.rows[row][1:place], strict=True))
    sets = [f"--set={one}" for one in (*model.overrides, *(f"{key}={value}" for key, value in values.items()))]
    subprocess.run([PROGRAM, "run", SCENE, *sets, "-q", "-o", folder], check=True)
    lines = (folder / "results.csv").read_text().splitlines()
    # Both files have the fewest digits that give the same bits again, in two notations.
    last = [float(cell) for title, cell in zip(study.columns, study.rows[row], strict=True) if title.startswith("final.")]
    assert [float(cell) for cell in lines[-1].split(",")[1:]] == last, "the last values of a row repeated by hand"
    head = lines[0].split(",")
    wanted = [0, *(head.index(name) for name in study.series.columns[2:])]
    all_samples = {tuple(float(line.split(",")[k]) for k in wanted) for line in lines[1:]}
    with study.series.path.open() as file:
        own = [tuple(map(float, line.split(",")[1:])) for line in file if line.startswith(f"{row + 1},")]
    assert len(own) == SERIES["samples"] and set(own) <= all_samples, "the series of a row repeated by hand"
    alone = odyn.study(model, [values], output=folder / "study", jobs=1)
    assert alone.rows[0][1:] == study.rows[row][1:], "the cells of a row repeated by hand"
    print(f"row {row + 1} by `odyn run`: same bits; as a study of its own: same bytes")


def main() -> None:
    """All of it."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else None)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--points", type=int, default=10_000)
    parser.add_argument("--shards", type=int, default=48)
    parser.add_argument("--workers", type=int, default=3)
    parser.add_argument("--t-end", default="200 ms", help="the scene's is 200 ms")
    arguments = parser.parse_args()
    folder: Path = arguments.folder.absolute()
    rows = points(arguments.points)
    model = odyn.load(SCENE).set({"simulation.t_end": arguments.t_end})
    watch = Watch()
    watch.pids = [os.getpid()]
    begin = time.monotonic()
    with watch():
        one = odyn.study(model, rows, output=folder / "one", jobs=1, **SERIES)
    print(f"{len(one)} runs, one job: {time.monotonic() - begin:.1f} s")
    watch.report("this process")
    same(one, on_a_cluster(model, rows, folder / "cluster", arguments.shards, arguments.workers), "the cluster")
    same(one, by_hand(model, rows, folder / "by-hand", min(8, arguments.shards)), "shards by hand")
    repeated(one, model, len(rows) * 2 // 3, folder / "alone")


if __name__ == "__main__":
    main()
