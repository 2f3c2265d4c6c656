"""What people see: the report and the simulation.

- `report`: the three answers, the page, its figures, the JSON document, drawings of the power surface; what a
  program takes as it is (`look`);
- `viewer`: the simulation, as a page or by a server on this computer, of a result or of any program.

Other houses import from `fiveaxis.show` only; what they may is in the stub beside this file. It imports all
houses but `job` and `cli`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
