"""Research around the optimiser: what drives and cutters are measured and computed to take.

- `calibration`: drive powers fitted to logs; `cutting`: power of milling and drilling, a job's budget;
- `pricing`: the energy of a program's text, and where it is slow;
- `surface`: the power surface over two rotary angles.

Other houses import from `fiveaxis.lab` only; what they may is in the stub beside this file. It imports
`base`, `model` and `nc`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
