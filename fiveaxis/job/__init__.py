"""One job: from a part or a path to the files that a machine and its programmer need.

- the job: `description` (its fields), `reading` (from a file or options), `guide` (explained);
- the task: `task` (a job resolved, once), of `loading` (what it names), `kept` (what its input states) and
  `placement` (where the part stands if nobody says); every later stage takes it;
- its run: `setup_choice` (`run_job`), `setup_search` and `box_search`, `stages`, `clearing` (optimisation
  clear of collisions), `solution`, `results` (its files), `unfinished` (what an interrupted one goes on
  from);
- programs: `planned_program` (motion), `program` (text, read back and verified), `release` (the release
  gate), `posting` (programs of motions and of other programs), `verifying` (any program), `program_costs`;
- a user's own program: `revised_program` (its operations, one by one), `in_place` (postures in the lines of
  one, verified and priced), `program_choice` (what is worth replacing it), `verifying` (shown as it is).
"""

from fiveaxis.job.clearing import optimise as optimise
from fiveaxis.job.description import SWEEP as SWEEP
from fiveaxis.job.description import Job as Job
from fiveaxis.job.description import PlanTable as PlanTable
from fiveaxis.job.description import SetupTable as SetupTable
from fiveaxis.job.loading import is_mesh as is_mesh
from fiveaxis.job.loading import load_job_machine as load_job_machine
from fiveaxis.job.loading import load_job_toolpath as load_job_toolpath
from fiveaxis.job.loading import load_surroundings as load_surroundings
from fiveaxis.job.loading import measure_plan as measure_plan
from fiveaxis.job.loading import part_of as part_of
from fiveaxis.job.loading import part_unit as part_unit
from fiveaxis.job.loading import plan_mesh as plan_mesh
from fiveaxis.job.posting import Posted as Posted
from fiveaxis.job.posting import make_of_motion as make_of_motion
from fiveaxis.job.posting import post_program as post_program
from fiveaxis.job.posting import write_program as write_program
from fiveaxis.job.process import cutting_power as cutting_power
from fiveaxis.job.program import MadeProgram as MadeProgram
from fiveaxis.job.program import make_program as make_program
from fiveaxis.job.program_costs import ProgramEnergy as ProgramEnergy
from fiveaxis.job.program_costs import program_energy as program_energy
from fiveaxis.job.program_options import ProgramOptions as ProgramOptions
from fiveaxis.job.reading import build_job as build_job
from fiveaxis.job.reading import choose_search as choose_search
from fiveaxis.job.reading import make_job as make_job
from fiveaxis.job.reading import read_fixtures as read_fixtures
from fiveaxis.job.reading import read_job as read_job
from fiveaxis.job.release import Gate as Gate
from fiveaxis.job.results import require_folder as require_folder
from fiveaxis.job.results import write_outcome as write_outcome
from fiveaxis.job.results import write_revised as write_revised
from fiveaxis.job.revised_program import RevisedProgram as RevisedProgram
from fiveaxis.job.revised_program import revise_operations as revise_operations
from fiveaxis.job.revised_program import revise_program as revise_program
from fiveaxis.job.revised_program import takes_operations as takes_operations
from fiveaxis.job.setup_choice import run_job as run_job
from fiveaxis.job.setup_choice import run_task as run_task
from fiveaxis.job.solution import Solution as Solution
from fiveaxis.job.stages import Outcome as Outcome
from fiveaxis.job.task import LEFT_OUT as LEFT_OUT
from fiveaxis.job.task import Task as Task
from fiveaxis.job.task import resolve as resolve
from fiveaxis.job.unfinished import digest_job as digest_job
from fiveaxis.job.unfinished import resumable as resumable
from fiveaxis.job.verifying import show_program as show_program
from fiveaxis.job.verifying import verify_program as verify_program
