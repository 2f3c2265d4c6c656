"""The choice of the rotary angles of every cutter location, by search and by CasADi.

- `problem`, `terms`: what is minimised, and bounds, written once; `local`: two solvers of it;
- `search`, `strategy`: the global search, and how it and the solvers follow each other;
- `baselines`, `bound`: what the result is compared with from above and from below;
- `turns`: turns of rotary axes, and their rewinds.

Other houses import from `fiveaxis.posture` only; what they may is in the stub beside this file. It imports
`base` and `model`: collisions come as a function, costs as data.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
