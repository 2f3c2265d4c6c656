"""From a part to passes of contact points: meshes, exact CAD surfaces, the planner.

- `mesh`: files, units and sizes, distances, smooth normals; `mesh.cad`: faces of STEP and IGES files;
- `contour`: sections, lines on faces, passes and their links; contacts of programmed paths.

Other houses import from `fiveaxis.cam` only; what they may is in the stub beside this file. It imports
`base` and `model`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
