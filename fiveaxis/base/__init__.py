"""What every house stands on: errors, findings, options, files, vectors; nothing of it knows a machine.

- errors and what is told: `errors` (the tree), `findings`, `codes` (every code with its meaning), `progress`,
  `interrupted` (what an interrupted job has found);
- what users say: `options` (each option once), `settings` (strict TOML), `entries` (its fields, explained),
  `files` (whole or not at all);
- numbers: `geometry` (vectors, rotations, intervals), `box_search`, `compiling` (how loops are compiled),
  `threads`;
- `notebook`: how objects show in a notebook.

Other houses import from `fiveaxis.base` only, never from a module in it; what they may is in the stub beside
this file. It imports no house.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
