# ---
# A tutorial in cells: open it as a notebook (VS Code, PyCharm, Spyder and jupytext know `# %%`), or run it as a script.
# It needs `pip install .` in the repository, and `pip install pandas meshio`. It runs in a few seconds.
# ---

# %% A case. The keys are those of a case file; `seixo init` writes commented ones, `seixo.run("FILE.toml")` runs them.
import numpy as np
import seixo

case = {
    "run": {"spacing": 0.01, "time_step": 1e-3, "adaptive": True, "end": 0.6, "dimensions": 2},
    "tank": {"min": [0.0, 0.0, 0.0], "max": [0.6, 0.1, 0.4], "open": ["z_max"]},
    "fluid": {"sound_speed": 4.0, "block": [{"min": [0.0, 0.0, 0.0], "max": [0.6, 0.1, 0.2]}]},
    "body": [
        {
            "name": "box",
            "size": [0.2, 0.1, 0.08],
            "center": [0.3, 0.05, 0.2],
            "density": 500.0,
            "displaces_fluid": True,
        }
    ],
    "contact": {"spring": 2e4, "restitution": 0.3},
    "gauge": {"every": 0.01, "level": [{"name": "beside", "at": [0.08, 0.0]}]},
    "output": {"every": 0.05},
}

# %% What it takes, before it runs.
plan = seixo.plan(case)
print(plan["particles"]["fluid"], "particles of water")

# %% Run it. What is wrong with a case is an exception with the program's message.
run = seixo.run(case, "out/box", backend="cpu", threads=1, force=True)
print(run, "verdict:", run.verdict)

try:
    seixo.run(case, "out/wrong", spacing=-0.02)
except seixo.CaseError as wrong:
    print(wrong)

# %% Tables are pandas.DataFrames, columns have Python names, units stand beside them.
box = run.body("box")
print(box[["time", "z", "velocity_z"]].tail(3))
print("water level beside the box:", run.gauges.beside.iloc[-1], run.units("gauges")["beside"])

# %% Frames are read when they are asked for.
last = run.frames[-1]
speed = np.linalg.norm(last.fluid.velocity, axis=1)
print(f"{len(run.frames)} frames; at {last.time:.2f} s the fastest of {len(last.fluid)} particles makes {speed.max():.2f} m/s")

# %% Step by step: nothing is written, and Python looks at whatever it likes between the steps.
sim = seixo.open(case, backend="cpu", threads=1)
heights = []


def watch(sim: seixo.Simulation, step: seixo.Step) -> bool:
    heights.append((step.time, sim.bodies["box"].position[2], sim.gauges["beside"]))
    # Enough seen when the water stands 1 cm above its level.
    return sim.gauges["beside"] < 0.21


sim.run_until(0.2, watch)
print(f"{sim.steps} steps to {sim.time:.3f} s on {sim.processor}; highest pressure {sim.pressure.max():.0f} Pa")

# %% Many runs: a body of any density, one run each.
drafts = {}
for density in [300.0, 500.0, 700.0]:
    name = f"out/box-{density:.0f}"
    # Let go where it should float, or it would heave for longer than the run.
    center = [0.3, 0.05, 0.2 + 0.04 - 0.08 * density / 1000]
    given = {"body.0.density": density, "body.0.center": center, "output.every": 0}
    each = seixo.run(case, name, set=given, backend="cpu", threads=1, force=True)
    floats = each.body("box")
    level = each.gauges.beside[each.gauges.time > 0.3].mean()
    # Lower edge below the water, over the height.
    drafts[density] = (level - (floats.z[floats.time > 0.3].mean() - 0.04)) / 0.08
print({density: round(float(draft), 2) for density, draft in drafts.items()})
