"""The package against the program: cases are run, results read. `pytest python/tests`, with the program installed or named
by SEIXO_PROGRAM, and numpy, tomli-w, meshio; with and without pandas."""

from __future__ import annotations

import builtins
import datetime
import importlib.util
import runpy
import shutil
import signal
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
import seixo

ROOT = Path(__file__).resolve().parents[2]

#: A gate, a floating box and gauges in two dimensions: 0.02 s, three frames.
CASE: dict[str, Any] = {
    "run": {"spacing": 0.05, "time_step": 1e-3, "end": 0.02, "dimensions": 2},
    "tank": {"min": [0, 0, 0], "max": (2.0, 0.1, 1.0), "open": ["z_max"]},
    "fluid": {"block": [{"min": [0, 0, 0], "max": np.array([0.5, 0.1, 0.5])}]},
    "moving_wall": [
        {"name": "gate \"é\"", "min": [0.6, 0, 0], "max": [0.8, 0, 0.8], "motion": [[0, 0, 0, 0], [1, 0, 0, 0.5]]}
    ],
    "body": [{"name": "box", "size": [0.2, 0.2, 0.2], "center": [1.4, 0, 0.1], "density": 500, "standing": True}],
    "contact": {"spring": 1e5, "restitution": None},
    "gauge": {"level": [{"name": "near gate", "at": [0.3, 0.0]}], "force": [{"name": "on box", "on": "box"}]},
    "output": {"every": 0.01},
}

REGION = {"min": [0.0, 0.0, 0.0], "max": [0.25, 0.1, 0.5]}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> seixo.Run:
    return seixo.run(CASE, tmp_path_factory.mktemp("run") / "out", backend="cpu")


def test_the_result_tells_how_it_ended(run: seixo.Run) -> None:
    assert (run.status, run.verdict) == ("done", run.result["verdict"]["grade"])
    assert run.result["steps"] == 20
    assert run.case["run"]["end"] == 0.02
    assert run.case["fluid"]["block"][0]["max"] == [0.5, 0.1, 0.5]
    assert "done" in repr(run) and "3 frames" in repr(run)


def test_tables_have_columns_by_attribute(run: seixo.Run) -> None:
    monitors: Any = run.monitors
    assert np.isclose(monitors.time.iloc[-1], 0.02) and len(monitors) == 21
    assert monitors.attrs["units"]["time"] == "s"
    gauges: Any = run.gauges
    assert 0.4 < gauges.near_gate.iloc[0] < 0.55
    assert run.units("gauges")["near_gate"] == "m"
    assert {"on_box_force_x", "on_box_torque_y"} <= set(gauges.columns)
    box: Any = run.body("box")
    assert len(box) == 21 and set(box["body"]) == {"box"} and box.index[0] == 0
    gate: Any = run.body("gate \"é\"")
    assert np.isclose(gate.z.iloc[-1] - gate.z.iloc[0], 0.01)
    with pytest.raises(KeyError, match="there are: .*box"):
        run.body("bax")
    with pytest.raises(FileNotFoundError, match="bodies, gauges, monitors"):
        run.table("levels")


def test_without_pandas_tables_are_arrays(run: seixo.Run, monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without(name: str, *args: Any, **kwargs: Any) -> Any:
        if name == "pandas":
            raise ImportError(name)
        return real(name, *args, **kwargs)

    frame: Any = run.table("bodies")
    monkeypatch.setattr(builtins, "__import__", without)
    plain = seixo.read(run.path)
    array: Any = plain.table("bodies")
    assert isinstance(array, np.recarray) and array.dtype.names == tuple(frame.columns)
    assert np.array_equal(array.z, frame.z.to_numpy()) and list(array.body) == list(frame.body)
    assert len(plain.body("box")) == 21


def test_frames_are_read_when_asked_for(run: seixo.Run) -> None:
    frames = run.frames
    assert np.allclose(frames.times, [0.0, 0.01, 0.02])
    assert frames.at(0.012) is frames[1] and len(frames[1:]) == 2
    water = frames[-1].fluid
    assert "_fields" not in vars(water)
    assert len(water) == run.result["particles"]["fluid"] and water.position.shape == (len(water), 3)
    assert water.velocity.shape == water.position.shape and water.pressure.max() > 500.0
    assert set(water.kind) == {0} and sorted(water.id) == sorted(frames[0].fluid.id)
    # Falling: the water has moved down and away from the wall.
    assert water.velocity[:, 2].mean() < 0.0 < water.velocity[:, 0].max()
    assert set(frames[0].solids.body) == {1, 2} and len(run.walls) > 50
    with pytest.raises(KeyError, match="there are: .*Velocity"):
        water.field("Vorticity")


def test_pieces_of_many_ranks_are_read_as_one(run: seixo.Run, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    shutil.copytree(run.path, folder)
    pieces = ["fluid_0000.vtu", "fluid_0001.vtu"]
    lines = "".join(f'<Piece Source="{piece}"/>' for piece in pieces)
    text = f'<VTKFile type="PUnstructuredGrid"><PUnstructuredGrid>{lines}</PUnstructuredGrid></VTKFile>'
    (folder / "vtu/fluid_0002.pvtu").write_text(text, encoding="utf-8")
    [listed] = folder.glob("*.pvd")
    listed.write_text(listed.read_text(encoding="utf-8").replace("fluid_0002.vtu", "fluid_0002.pvtu"), encoding="utf-8")
    frames = seixo.read(folder).frames
    parts, water = [frame.fluid for frame in frames[:2]], frames[2].fluid
    for name in ["position", "velocity", "pressure", "id"]:
        assert np.array_equal(getattr(water, name), np.concatenate([getattr(part, name) for part in parts]))
    assert len(water) == 2 * len(parts[0]) and water.velocity.any()
    (folder / "vtu/fluid_0002.pvtu").write_text(text.replace(pieces[0], "../../fluid_0000.vtu"), encoding="utf-8")
    with pytest.raises(ValueError, match="no piece"):
        _ = seixo.read(folder).frames[2].fluid.position


def test_a_region_without_water_has_a_frame_of_nothing(tmp_path: Path) -> None:
    dry = {"min": [1.0, 0.0, 0.5], "max": [1.2, 0.1, 0.9]}
    out = seixo.run(CASE, tmp_path / "out", backend="cpu", steps=2, set={"output.region": dry})
    water = out.frames[0].fluid
    assert (len(water), water.velocity.shape, water.pressure.shape) == (0, (0, 3), (0,))


def test_damaged_results_are_left_out_or_named(run: seixo.Run, tmp_path: Path) -> None:
    root = tmp_path / "run"

    def fresh() -> Path:
        shutil.rmtree(root, ignore_errors=True)
        shutil.copytree(run.path, root)
        return root / "vtu" / "fluid_0001.vtu"

    frame = fresh()
    whole = frame.read_bytes()
    for kept, words in ((len(whole) // 2, "is cut off"), (0, "is empty")):
        frame.write_bytes(whole[:kept])
        with pytest.warns(UserWarning, match=f"left out: .*fluid_0001.vtu {words}"):
            assert len(seixo.read(root).frames) == 2
    # What shows in the arrays alone ends no program.
    at = whole.index(b"<AppendedData") + 200
    frame.write_bytes(whole[:at] + b"A" * 200 + whole[at + 200 :])
    with pytest.raises(seixo.FileError, match="fluid_0001.vtu: damaged"):
        seixo.read(root).frames[1].fluid.velocity

    fresh()
    listed = next(root.glob("*.pvd"))
    text = listed.read_text(encoding="utf-8")
    listed.write_text(text[: text.index("_0001.")], encoding="utf-8")
    with pytest.warns(UserWarning, match="is cut off"):
        frames = seixo.read(root).frames
    assert len(frames) == 1
    with pytest.raises(IndexError, match="there are 1"):
        frames[1]
    listed.unlink()
    with pytest.raises(IndexError, match="output.every"):
        seixo.read(root).frames[-1]
    for name, of, held, words in (
        ("result.json", "status", b"", "damaged"),
        ("monitors.csv", "monitors", b"", "line 1: it is empty"),
        ("gauges.csv", "gauges", b"a,b\n1,2\n", "line 1: it has no column 'time .s.'"),
        ("bodies.csv", "bodies", b"time [s],x\n1,2\n", "line 1: it has no column 'body'"),
        ("monitors.csv", "monitors", b"time [s],x\n1,2\n2\n3,4\n", "line 3: it has 1 values, the line of names 2"),
        ("monitors.csv", "monitors", b"time [s],x\n1,2\n2,\xff\n", "no text in UTF-8"),
    ):
        fresh()
        (root / name).write_bytes(held)
        with pytest.raises(seixo.FileError, match=f"{name}: .*{words}"):
            getattr(seixo.read(root), of)
    # A run in progress may be in the middle of its last row.
    (root / "monitors.csv").write_bytes(b"time [s],x\n1,2\n2")
    assert list(seixo.read(root).monitors["x"]) == [2.0]


def test_values_that_no_case_has_are_named_by_their_key() -> None:
    wrong: Any
    for wrong, words in (
        (CASE | {"run": {"end": 1j}}, "run.end: a value of type complex"),
        (CASE | {"body": [{"center": [0, None, 0]}]}, "body.0.center.1: None"),
        ([1, 2], "a TOML file or a dict"),
    ):
        with pytest.raises(TypeError, match=words):
            seixo.run(wrong)
    for wrong, words in (({"run.end": None}, "run.end: None"), (["run.end=1"], "set: a dict such as")):
        with pytest.raises(TypeError, match=words):
            seixo.plan(CASE, set=wrong)
    wrong = 2.5
    with pytest.raises(TypeError, match="steps: a whole number, not 2.5"):
        seixo.run(CASE, steps=wrong)


def test_numbers_and_times_of_other_types_are_taken(tmp_path: Path) -> None:
    steps: Any = 3.0
    ended = seixo.run(CASE, tmp_path / "out", set={"run.end": Fraction(1, 50)}, backend="cpu", steps=steps)
    assert ended.result["steps"] == 3 and ended.case["run"]["end"] == 0.02
    stopped = seixo.run(CASE, tmp_path / "long", until=60.0, backend="cpu", max_wall=datetime.timedelta(seconds=0.2))
    assert stopped.status == "interrupted"


def test_numbers_of_numpy_and_bodies_called_by_a_number(tmp_path: Path) -> None:
    case = {**CASE, "body": [{**CASE["body"][0], "name": "007"}], "moving_wall": [], "gauge": {}}
    run = seixo.run(case, tmp_path / "out", until=np.float64(0.002), spacing=np.float64(0.05), backend="cpu")
    assert run.result["time_s"] == pytest.approx(0.002)
    assert set(run.bodies.body) == {"007"} and len(run.body("007").x) == 3
    with pytest.raises(TypeError, match="until: a number, not a value of type str"):
        seixo.run(CASE, tmp_path / "other", until=cast(Any, "0.1"))


def test_options_change_the_case_and_the_run(tmp_path: Path) -> None:
    file = tmp_path / "a case.toml"
    file.write_text((ROOT / "cases/resting_cube.toml").read_text(), encoding="utf-8")
    sets = {"output.kinds": ["body"], "body.0.density": 700, "body.0.center": (0.4, 0.4, 0.11)}
    run = seixo.run(file, tmp_path / "out", until=0.01, set=sets, threads=1)
    assert run.case["run"]["end"] == 0.01 and run.case["body"][0]["density"] == 700
    assert run.case["output"]["kinds"] == ["body"]
    with pytest.raises(FileNotFoundError, match="no such table"):
        _ = run.gauges
    with pytest.raises(LookupError, match="no water"):
        _ = run.frames[0].fluid
    with pytest.raises(seixo.CaseError, match="--force"):
        seixo.run(file, tmp_path / "out", until=0.01, set=sets)
    again = seixo.run(file, tmp_path / "out", until=0.01, set=sets, force=True, steps=3)
    assert again.result["steps"] == 3


def test_errors_are_exceptions_with_the_message_of_the_program(tmp_path: Path) -> None:
    with pytest.raises(seixo.CaseError, match="out of range") as wrong:
        seixo.run({**CASE, "run": {**CASE["run"], "spacing": -0.03}}, tmp_path / "a")
    assert wrong.value.code == 2 and "run.spacing" in str(wrong.value)
    with pytest.raises(seixo.CaseError, match="no case file"):
        seixo.run(tmp_path / "none.toml")
    with pytest.raises(seixo.CaseError, match="viscosty"):
        seixo.plan(CASE, set={"fluid.viscosty": 0})
    (tmp_path / "file").write_text("")
    with pytest.raises(seixo.FileError):
        seixo.run(CASE, tmp_path / "file" / "out")
    with pytest.raises(FileNotFoundError, match="no results"):
        seixo.read(tmp_path)


def test_a_run_that_means_nothing_says_so_and_keeps_its_results(tmp_path: Path) -> None:
    fast = {**CASE, "fluid": {"block": [{**CASE["fluid"]["block"][0], "velocity": [0, 0, 3000]}]}}
    with pytest.raises(seixo.DivergedError) as failed:
        seixo.run(fast, tmp_path / "out", backend="cpu")
    assert failed.value.run is not None and failed.value.run.verdict == "failed"
    assert len(failed.value.run.frames) == 3


def test_a_run_that_was_stopped_goes_on(tmp_path: Path) -> None:
    long = {**CASE, "run": {**CASE["run"], "end": 50.0}}
    first = seixo.run(long, tmp_path / "out", max_wall=0.3, backend="cpu")
    assert first.status == "interrupted" and 0.0 < first.result["time_s"] < 50.0
    second = seixo.run(long, tmp_path / "out", max_wall=0.3, backend="cpu", resume=True)
    assert second.result["time_s"] > first.result["time_s"]


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX's")
def test_ctrl_c_reaches_python_after_the_state_is_saved(tmp_path: Path) -> None:
    import subprocess

    # What is started in the background ignores SIGINT.
    heed = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
    script = heed + f"import seixo; seixo.run({str(ROOT / 'cases/dam_break_2d.toml')!r}, 'out', until=50.0, backend='cpu')"
    process = subprocess.Popen([sys.executable, "-c", script], cwd=tmp_path, stderr=subprocess.PIPE, start_new_session=True)
    import os
    import time

    for _ in range(600):
        if (tmp_path / "out/monitors.csv").is_file():
            break
        time.sleep(0.05)
    time.sleep(0.5)
    os.killpg(process.pid, signal.SIGINT)
    _, remarks = process.communicate(timeout=60)
    assert b"KeyboardInterrupt" in remarks
    assert seixo.read(tmp_path / "out").status == "interrupted"
    assert list((tmp_path / "out/checkpoint").glob("*.seixo"))


def test_plan_tells_what_a_run_takes() -> None:
    plan = seixo.plan(CASE, spacing=0.025)
    assert plan["spacing_m"] == 0.025 and plan["particles"]["fluid"] == 400


def test_the_tutorial_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pandas")
    monkeypatch.chdir(tmp_path)
    names = runpy.run_path(str(ROOT / "python/tutorial.py"))
    assert names["run"].status == "done" and len(names["drafts"]) == 3
    assert len(names["heights"]) == names["sim"].steps > 10


def test_the_python_of_the_guide_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pandas")
    monkeypatch.chdir(tmp_path)
    parts = (ROOT / "docs/python.md").read_text(encoding="utf-8").split("```python\n")[1:]
    assert len(parts) == 4
    names: dict[str, Any] = {}
    for part in parts:
        exec(part.split("```")[0], names)  # noqa: S102, the guide's own
    assert names["run"].status == "done" and names["unit"] == "N" and names["peak"] >= 0.0
    assert np.isclose(names["sim"].time, 0.1, atol=2e-3) and len(names["front"]) > 20


def test_fields_that_were_not_written_are_named(tmp_path: Path) -> None:
    few = seixo.run(CASE, tmp_path / "few", set={"output.fields": ["velocity"], "output.region": REGION}, backend="cpu")
    water = few.frames[-1].fluid
    assert len(water.velocity) == len(water) > 0
    assert (water.position[:, 0] <= 0.25).all()
    with pytest.raises(KeyError, match="no field 'Pressure' .`output.fields`.*Velocity"):
        _ = water.pressure
    assert set(few.frames[-1].solids.body) == {1, 2}


def test_series_are_frames_by_name(tmp_path: Path) -> None:
    series = {"name": "near", "every": 0.005, "kinds": ["fluid"], "fields": ["velocity"], "region": REGION}
    out = seixo.run(CASE, tmp_path / "near", set={"output.series": [series]}, backend="cpu")
    near = out.series["near"]
    assert list(out.series) == ["near"] and out.result["series"] == {"near": len(near)}
    assert len(near) > len(out.frames) > 1
    assert (near[-1].fluid.position[:, 0] <= 0.25).all() and len(near[-1].fluid) < len(out.frames[-1].fluid)
    with pytest.raises(LookupError, match="no bodies"):
        _ = near[-1].solids


#: Water that passes a piece of a channel.
CHANNEL: dict[str, Any] = {
    "run": {"spacing": 0.05, "time_step": 2e-3, "end": 0.6, "dimensions": 2},
    "tank": {"min": [0, 0, 0], "max": [1, 0, 0.5], "open": ["z_max"]},
    "fluid": {"block": [{"min": [0, 0, 0], "max": [1, 0, 0.2], "velocity": [0.5, 0, 0]}]},
    "inflow": [{"name": "in", "face": "x_min", "min": [0, 0, 0], "max": [0, 0, 0.2], "velocity": 0.5}],
    "outflow": [{"name": "out", "face": "x_max", "velocity": 0.5}],
    "output": {"every": 0},
}


def test_volumes_of_water_that_passes(tmp_path: Path) -> None:
    out = seixo.run(CHANNEL, tmp_path / "channel", backend="cpu")
    water = out.water
    assert set(water) == {"water_volume", "start", "lost", "inflow_in", "outflow_out"}
    assert water["inflow_in"] > 0 and water["outflow_out"] > 0
    left = water["start"] + water["inflow_in"] - water["outflow_out"] - water["lost"]
    assert np.isclose(left, water["water_volume"], rtol=1e-9)
    last = {name: out.monitors[name][len(out.monitors["time"]) - 1] for name in ("water_volume", "inflow_in", "outflow_out")}
    assert all(np.isclose(last[name], water[name], rtol=1e-6) for name in last)


stepped = pytest.mark.skipif(not importlib.util.find_spec("seixo._native"), reason="the compiled part is not installed")


@stepped
def test_stepping_tells_the_volumes_that_the_program_does(tmp_path: Path) -> None:
    out = seixo.run(CHANNEL, tmp_path / "channel", backend="cpu", threads=1, set={"run.end": 0.2})
    sim = seixo.open({**CHANNEL, "run": {**CHANNEL["run"], "end": 0.2}}, backend="cpu", threads=1)
    assert sim.monitor["inflow_in"] == 0.0
    while sim.time < 0.2 - 1e-9:
        sim.step()
    told = {name: sim.monitor[name] for name in ("water_volume", "inflow_in", "outflow_out")}
    assert told == pytest.approx({name: out.water[name] for name in told}, rel=1e-9) and told["inflow_in"] > 0


@stepped
def test_stepping_is_the_run_of_the_program(run: seixo.Run) -> None:
    sim = seixo.open(CASE, backend="cpu", threads=1)
    assert sim.time == 0.0 and sim.steps == 0 and sim.end == 0.02 and "f64" in sim.processor
    still = sim.water
    assert len(still) == 100 and still.position.shape == (100, 3) and not still.pressure.any()
    steps = list(sim)
    assert len(steps) == sim.steps == 20 and np.isclose(sim.time, 0.02)
    assert steps[-1].dt == 1e-3 and steps[-1].solved and steps[-1].iterations > 0
    # To the last bit: tables hold as many digits as a number has.
    monitors: Any = run.monitors
    for name in ["energy", "kinetic", "speed_max"]:
        assert sim.monitor[name] == monitors[name].iloc[-1], name
    assert [s.iterations for s in steps] == list(monitors.iterations[1:])
    gauges: Any = run.gauges
    assert sim.gauges["near gate"] == gauges.near_gate.iloc[-1]
    box, table = sim.bodies["box"], cast(Any, run.body("box"))
    assert list(sim.bodies) == list(dict.fromkeys(run.bodies["body"])) and box.is_body and not sim.bodies["gate \"é\""].is_body
    assert box.position[2] == table.z.iloc[-1] and box.fluid_force[2] == table.fluid_force_z.iloc[-1]
    # Frames hold single precision.
    last = run.frames[-1].fluid
    ours, theirs = np.argsort(sim.water.id), np.argsort(last.id)
    assert np.array_equal(sim.positions[ours].astype(np.float32), last.position[theirs])
    assert np.array_equal(sim.velocity[ours].astype(np.float32), last.velocity[theirs])
    assert np.array_equal(sim.pressure[ours].astype(np.float32), last.pressure[theirs])
    # What was taken is a copy.
    assert not still.pressure.any() and sim.water is sim.water
    with pytest.raises(ValueError, match="read-only"):
        sim.positions[0] = 0.0


@stepped
def test_observers_look_on_and_end_a_run() -> None:
    sim = seixo.open(CASE, set={"run.end": 1.0}, backend="cpu", threads=1)
    seen: list[float] = []

    def watch(sim: seixo.Simulation, step: seixo.Step) -> bool:
        seen.append(step.time)
        return len(seen) < 7

    sim.run_until(0.5, watch)
    assert sim.steps == 7 and seen[-1] == sim.time
    sim.run_until(0.01)
    assert sim.steps == 10

    def fails(sim: seixo.Simulation, step: seixo.Step) -> None:
        raise RuntimeError("seen enough")

    with pytest.raises(RuntimeError, match="seen enough"):
        sim.run_until(0.5, fails)
    assert sim.steps == 11


@stepped
def test_what_is_wrong_is_an_exception_of_stepping_too(tmp_path: Path) -> None:
    with pytest.raises(seixo.CaseError, match="viscosty") as wrong:
        seixo.open(CASE, set={"fluid.viscosty": 0})
    assert wrong.value.code == 2
    with pytest.raises(seixo.CaseError, match="no case file"):
        seixo.open(tmp_path / "none.toml")
    with pytest.raises(seixo.CaseError, match="it is \"auto\""):
        seixo.open(CASE, backend="quantum")
    with pytest.raises(seixo.CaseError, match="chooses a GPU"):
        seixo.open(CASE, backend="cpu", adapter=0)
    with pytest.raises(seixo.CaseError, match="begins at t = 0"):
        seixo.open(CASE, set={"run.from": str(tmp_path)})
    fast = {**CASE, "fluid": {"block": [{**CASE["fluid"]["block"][0], "velocity": [0, 0, 3000]}]}}
    with pytest.raises(seixo.DivergedError, match="stage"):
        seixo.open(fast, backend="cpu").run_until(1.0)


def test_without_the_compiled_part_it_is_said_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "seixo._native", None)
    monkeypatch.delattr(seixo, "_native", raising=False)
    with pytest.raises(ImportError, match="pip install"):
        seixo.open(CASE)


@stepped
def test_the_command_is_there_as_a_module() -> None:
    import subprocess

    told = subprocess.run([sys.executable, "-m", "seixo", "--version"], capture_output=True, text=True, check=True)
    assert told.stdout.startswith("seixo 0.")
    wrong = subprocess.run([sys.executable, "-m", "seixo", "plan", "none.toml"], capture_output=True, text=True)
    assert wrong.returncode == 2 and "no case file" in wrong.stderr
    typo = subprocess.run([sys.executable, "-m", "seixo", "rum"], capture_output=True, text=True)
    assert typo.returncode == 2 and "unrecognized subcommand" in typo.stderr
