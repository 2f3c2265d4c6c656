"""Programs and CL files in, programs out; inches, degrees and mm/min are converted here.

- `apt`, `languages`: dialects that are read; `control`: the interpreter state and motion common to all;
- `controls`: what each control decides, as data; `program_options`, `writing`: text of a program's motion;
- `traced_program`, `operations`: a program as rows, and as operations; `operation_text`, `revised_words`:
  other positions in a program's own lines.

Other houses import from `fiveaxis.nc` only; what they may is in the stub beside this file. It imports `base`
and `model`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
