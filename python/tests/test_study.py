"""Studies: the table is that of one job, whoever does the runs."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import odyn
import pytest
from conftest import ROOT
from odyn._study import _quantities


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


def test_keys_with_expressions_are_texts_and_quantities_numbers(model, tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    for k, (texts, numbers, unit) in enumerate(
        [
            (["40 mm", "4.1e1 mm"], [40.0, 41.0], "mm"),
            (["3 * crank.radius", "4 * crank.radius"], None, None),
            (["2^5 * 1 mm", "40 mm"], None, None),
            (["80 mm / 2", "82 mm / 2"], None, None),
        ]
    ):
        found = odyn.study(model, [{"rod.length": text} for text in texts], output=tmp_path / str(k)).arrow()
        field = found.schema.field("rod.length")
        assert field.type == (pyarrow.string() if numbers is None else pyarrow.float64()), texts
        assert found["rod.length"].to_pylist() == (numbers or texts)
        assert (field.metadata or {}).get(b"unit", b"").decode() == (unit or "")
    assert _quantities(["40", "41"]) == (["40", "41"], "")
    assert _quantities(["4_0", "4_1"]) == ([], "")


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


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="signals of Unix, /proc of Linux")
def test_a_cluster_that_loses_a_worker_and_shards_that_are_killed_give_the_same_bytes(model, tmp_path):
    pytest.importorskip("distributed")
    script = [sys.executable, ROOT / "python" / "examples" / "cluster.py", tmp_path / "studies"]
    options = ["--points", "120", "--shards", "12", "--t-end", "20 ms"]
    done = subprocess.run([*script, *options], capture_output=True, text=True, timeout=280, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    for what in ["killed a worker", "the cluster: same bytes", "shards by hand: same bytes", "row 81 by `odyn run`: same bits"]:
        assert what in done.stdout, done.stdout + done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="locks of Unix")
def test_a_shard_that_another_program_does_is_waited_for(model, tmp_path):
    import fcntl

    from odyn._study import _shard

    points = tmp_path / "points.csv"
    points.write_text("rod.length\n50 mm\n")
    arguments = ["study", str(model.path), "--csv", str(points), "--set=simulation.t_end=20", "-q", "-o", str(tmp_path)]
    with (tmp_path / "part-00001-of-00001.journal").open("a") as journal:
        fcntl.flock(journal, fcntl.LOCK_EX)
        with ThreadPoolExecutor() as pool:
            found = pool.submit(_shard, 1, 1, arguments)
            time.sleep(0.5)
            assert not found.done()
            fcntl.flock(journal, fcntl.LOCK_UN)
            assert found.result(60) == 1
    assert len(odyn.merge(tmp_path)) == 1


def test_series_are_those_of_the_runs(model, tmp_path):
    found = odyn.study(model, POINTS, output=tmp_path, series=["x_p", "theta"], samples=9)
    assert found.series.columns == ["run", "t", "theta", "x_p"]  # as in the scene
    assert found.series.units == {"run": "", "t": "ms", "theta": "rad", "x_p": "mm"}
    assert len(found.series.path.read_text().splitlines()) == 1 + 12 * 9
    run = model.set(POINTS[7]).run()
    frame = pytest.importorskip("pandas") and found.series.to_pandas()
    own = frame[frame["run"] == 8]
    places = [round(k * (len(run.t) - 1) / 8) for k in range(9)]
    assert own["x_p"].tolist() == run["x_p"][places].tolist() and own["t"].tolist() == run.t[places].tolist()
    every = odyn.study(model, POINTS[:2], output=tmp_path / "every", series="*", every=10)
    assert len(every.series.columns) == 2 + len(run) and len(every.series.to_pandas()) == 2 * len(range(0, len(run.t), 10))
    with pytest.raises(odyn.Error, match="x_q") as refused:
        odyn.study(model, POINTS, output=tmp_path / "wrong", series=["x_q"])
    assert refused.value.code == "ODY0318"
    with pytest.raises(ValueError, match="name its outputs"):
        odyn.study(model, POINTS, output=tmp_path / "wrong", every=3)
    with pytest.raises(FileNotFoundError, match="keeps outputs"):
        odyn.study(model, POINTS[:1], output=tmp_path / "none").series  # noqa: B018


def test_parquet_has_numbers_with_units(model, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    points = [*POINTS, {"rod.length": "3 mm", "piston.mass": 0.03}]
    found = odyn.study(model, points, output=tmp_path, series=["x_p"], every=4)
    assert found["status"][-1] == "failed"
    table = parquet.read_table(found.to_parquet(tmp_path / "study.parquet"))
    units = json.loads(table.schema.metadata[b"units"])
    assert units["rod.length"] == "mm" and units["final.x_p"] == "mm"
    assert table.schema.field("final.x_p").metadata == {b"unit": b"mm"}
    assert table["rod.length"].to_pylist()[:3] == [40.0, 40.0, 41.0]
    last = [float(cell) if cell else None for cell in found["final.x_p [mm]"]]
    assert table["final.x_p"].to_pylist() == last and last[-1] is None and table["steps"].to_pylist()[-1] is None
    # Piece by piece, and all at once.
    series = parquet.read_table(found.series.to_parquet(tmp_path / "series.parquet"))
    assert series.equals(found.series.arrow()) and json.loads(series.schema.metadata[b"units"]) == {"t": "ms", "x_p": "mm"}
    assert series["x_p"].to_pylist() == found.series.to_pandas()["x_p"].tolist()
    assert sorted(set(series["run"].to_pylist())) == list(range(1, 13))
    duckdb = pytest.importorskip("duckdb")
    query = f"""select "rod.length" as length, max(x_p) - min(x_p) as stroke
        from '{tmp_path}/study.parquet' join '{tmp_path}/series.parquet' using (run) group by all order by length"""
    strokes = duckdb.sql(query).fetchall()
    own = found.series.to_pandas().groupby("run")["x_p"]
    assert [row[0] for row in strokes] == [40.0, 41.0, 42.0, 43.0, 44.0, 45.0]
    assert strokes[0][1] == max((own.max() - own.min()).iloc[:2])
