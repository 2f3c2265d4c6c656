"""Look at a result as in a notebook: tables of facts, frames of numbers, power surface and simulation.

Editors and Jupyter (with jupytext) run this file cell by cell: each `# %%` begins one, and a cell whose last
line names an object shows it. A machine, a path or a solution shows as a table, a surface as its drawing, the
preview as the simulation itself. In plain Python the same lines show nothing, and print the same.
"""

# %% A ring on the underside of a dome, from contacts and normals in mm
import numpy as np

import fiveaxis as fx

around, down = np.linspace(0.0, 2.0 * np.pi, 60), np.radians(25.0)
level = np.full_like(around, -np.sin(down))
normals = np.column_stack([np.cos(down) * np.cos(around), np.cos(down) * np.sin(around), level])
toolpath = fx.Toolpath.from_contacts(30.0 * normals + (40.0, 0.0, 30.0), normals, fx.Tool.ball(8))
machine = fx.load_machine("hayashi-640123")
machine

# %% The result beside its baselines
solution = fx.optimise(toolpath, machine, tilt=(15, 75), effort="quick")
solution

# %% Every move of the program as a pandas frame: time and travel of each axis, by phase
moves = solution.program().motion.to_frame()
axes = [name for name in moves if name.endswith(("_mm", "_deg"))]
travel = moves[axes].diff().abs().assign(time_s=moves["time_s"]).groupby(moves["phase"], sort=False).sum()
print(travel.round(1).to_string())

# %% Where the tool turns fastest along the cut, deg/s
cut = solution.motion.to_frame()
rate = cut["C_deg"].diff().abs() / cut["time_s"]
print(f"C turns fastest before location {rate.idxmax()}: {rate.max():.0f} deg/s")

# %% The power surface at the middle of the path: where cheap postures lie, and what was chosen
surface = fx.location_surface(solution)
least = surface.power.total[surface.admissible].min()
print(f"S_W of admissible postures: from {least:.0f} J")
surface

# %% The same along the path, with result and baselines in its valley
valley = fx.path_valley(solution)
for name, heights in valley.heights.items():
    print(f"{name}: {heights.min():.0f} to {heights.max():.0f} J above the axes' zero")
valley

# %% The simulation, inline: it needs no server and stays in the notebook
view = fx.preview(solution, open_browser=False)
print(f"simulation: {len(view.page) / 1e6:.1f} MB")
view
