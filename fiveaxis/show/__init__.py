"""What people see: the report and the simulation.

- `report`: the three answers, the page, its figures, the JSON document, drawings of the power surface;
- `viewer`: the simulation, as a page or by a server on this computer.

Other houses import from `fiveaxis.show` only; what they may is in the stub beside this file. It imports all
houses but `job` and `cli`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
