"""Whether a program is safe: an opinion of its own, that shares no code with the search.

- `collision`: bodies around the tool, clearances, which postures are clear; `stock`: what is left of it;
- `placing`: where the part can stand so that a path is reached, and where it stands when nobody says;
- `verification`: one list of checks of programs, ours and others'; the release gate.

Search and verification are two engines on purpose: a fault of one must not hide in the other. `collision`
has both the mask of the search (`obstacles`) and the query of the check (`pieces`); a test holds that these
share no tree and no loop.

Other houses import from `fiveaxis.check` only; what they may is in the stub beside this file. It imports
`base`, `model`, `cam` and `nc`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
