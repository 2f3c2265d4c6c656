"""Machine, tool, path and motion: geometry that is known, and what drives take for it.

- `machine`: form-shaping code, chain, axes, drives, files; `kinematics`: forward, inverse, the tip's slopes;
- `toolpath`: tool, path, the curve through its locations, constraints of the posture;
- `motion`: inserted and left-out blocks, time law, the control's clock;
- `energy`: power of drives, energy of motions.

Other houses import from `fiveaxis.model` only; what they may is in the stub beside this file. It imports
`base`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
