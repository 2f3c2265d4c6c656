"""One job: from a part or a path to the files that a machine and its programmer need.

- the job: `description` (its fields), `reading` (from a file or options), `guide` (explained);
- the task: `task` (a job resolved, once), of `loading` (what it names) and
  `placement` (where the part stands if nobody says); every later stage takes it;
- its run: `setup_choice` (`run_job`), `setup_search`, `stages`, `clearing` (optimisation
  clear of collisions), `solution`, `results` (its files), `digest` (whether it is the same);
- programs: `planned_program` (motion), `program` (text, read back and verified),
  `posting` (programs of motions and of other programs);
- a user's own program: `revised_program` (its operations, one by one), `in_place` (postures in the lines of
  one, verified and priced), `program_choice` (what is worth replacing it).
- `batch`: many jobs on many processes or computers.

`cli` imports from `fiveaxis.job` only; what it may is in the stub beside this file. It imports all other
houses.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
