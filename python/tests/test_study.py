"""Studies: the table is that of one job, whoever does the runs."""

from __future__ import annotations

import subprocess
import sys

import odyn
import pytest
from conftest import ROOT


@pytest.fixture
def model(program):
    if "--shard" not in program("study", "--help").stdout:
        pytest.skip("the program that came along has no shards yet")
    return odyn.load(ROOT / "scenes" / "compressor.toml").set({"simulation.t_end": 20})


POINTS = odyn.grid({"rod.length": [f"{40 + k} mm" for k in range(6)], "piston.mass": [0.03, 0.05]})


def test_points_are_runs(model, tmp_path):
    found = odyn.study(model, POINTS, output=tmp_path / "one", jobs=1)
    assert len(found) == 12 and found["rod.length"][:3] == ["40 mm", "40 mm", "41 mm"]
    several = odyn.study(model, POINTS, output=tmp_path / "two", jobs=2)
    assert found.path.read_bytes() == several.path.read_bytes()
    # A row repeated by hand.
    row = 7
    run = model.set(POINTS[row]).run()
    assert float(found["final.x_p [mm]"][row]) == run["x_p"][-1]
    assert int(found["steps"][row]) == run.summary["steps"]
    frame = found.to_pandas()
    assert frame.shape == (12, len(found.columns))
    columns = {"rod.length": [point["rod.length"] for point in POINTS], "piston.mass": [point["piston.mass"] for point in POINTS]}
    assert odyn.study(model, columns, output=tmp_path / "three").path.read_bytes() == found.path.read_bytes()
    read = pytest.importorskip("pyarrow.parquet").read_table(found.to_parquet(tmp_path / "table.parquet"))
    assert read.num_rows == 12


def test_rows_fail_alone_and_studies_with_a_reason(model, tmp_path):
    found = odyn.study(model, [{"rod.length": "50 mm"}, {"rod.length": "3 kg"}], output=tmp_path)
    assert found["status"] == ["completed", "failed"]
    points = [{"rod.length": "50 mm"}, {"rod.length": "3 kg"}]
    again = odyn.study(model, points, output=tmp_path, resume=True, retry_failed=True)
    assert again.rows == found.rows
    with pytest.raises(odyn.Error, match="rod.lenght"):
        odyn.study(model, [{"rod.lenght": "50 mm"}], output=tmp_path)
    with pytest.raises(ValueError, match="one point or more"):
        odyn.study(model, [], output=tmp_path)
    with pytest.raises(ValueError, match="same keys"):
        odyn.study(model, [{"rod.length": 1}, {"piston.mass": 1}], output=tmp_path)


CLUSTER = """
import os, signal, sys, threading, time
import odyn
from pathlib import Path

if __name__ == "__main__":
    from dask.distributed import Client, LocalCluster

    model = odyn.load(sys.argv[1]).set({"simulation.t_end": 20})
    points = odyn.grid({"rod.length": [f"{40 + 0.25 * k} mm" for k in range(24)], "piston.mass": [0.03, 0.05]})
    one = odyn.study(model, points, output=Path(sys.argv[2]) / "one", jobs=1)
    output = Path(sys.argv[2]) / "cluster"
    output.mkdir()
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        worker = next(iter(cluster.workers.values())).process.process.pid

        def kill():
            while len(list(output.glob("part-*.csv"))) < 4:
                time.sleep(0.01)
            os.kill(worker, signal.SIGKILL)
            print("killed")

        killer = threading.Thread(target=kill, daemon=True)
        killer.start()
        several = odyn.study(model, points, output=output, client=client, shards=12)
        killer.join(10)
    assert one.path.read_bytes() == several.path.read_bytes()
    print("same bytes")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of Unix")
def test_a_cluster_that_loses_a_worker_gives_the_same_table(model, tmp_path):
    pytest.importorskip("distributed")
    script = tmp_path / "cluster.py"
    script.write_text(CLUSTER)
    path = ROOT / "scenes" / "compressor.toml"
    done = subprocess.run(
        [sys.executable, script, path, tmp_path], capture_output=True, text=True, timeout=240, check=False, cwd=tmp_path
    )
    assert "killed" in done.stdout and "same bytes" in done.stdout, done.stdout + done.stderr
