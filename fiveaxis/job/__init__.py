"""One job: from a part or a path to the files that a machine and its programmer need.

- the job: `description` (its fields), `reading` (from a file or options), `guide` (explained), `loading`
  (what it names), `placement` (where the part stands if nobody says);
- its run: `setup_choice` (`run_job`), `setup_search`, `box_search`, `stages`, `clearing` (optimisation clear
  of collisions), `solution`, `results` (its files), `unfinished` (what an interrupted
  one goes on from);
- programs: `planned_program` (motion), `program` (text, read back and verified), `release` (the release
  gate), `posting` (programs of motions and of other programs), `verifying` (any program), `program_costs`;
- a user's own program: `revised_program` (its operations, one by one), `in_place` (postures in the lines of
  one, verified and priced), `program_choice` (what is worth replacing it), `shown_program` (as it is).
"""

from fiveaxis.job.clearing import optimise
from fiveaxis.job.description import SWEEP, Job, PlanTable, SetupTable
from fiveaxis.job.loading import (
    is_mesh,
    load_job_machine,
    load_job_passes,
    load_job_toolpath,
    load_surroundings,
    measure_plan,
    part_of,
    part_unit,
)
from fiveaxis.job.placement import PlacedJob, load_placed
from fiveaxis.job.posting import Posted, make_of_motion, post_program, write_program
from fiveaxis.job.process import cutting_power
from fiveaxis.job.program import MadeProgram, make_program
from fiveaxis.job.program_costs import ProgramEnergy, program_energy
from fiveaxis.job.program_options import ProgramOptions
from fiveaxis.job.reading import build_job, choose_search, make_job, read_fixtures, read_job
from fiveaxis.job.release import Gate
from fiveaxis.job.results import require_folder, write_outcome, write_revised
from fiveaxis.job.revised_program import RevisedProgram, revise_operations, revise_program, takes_operations
from fiveaxis.job.setup_choice import run_job
from fiveaxis.job.shown_program import show_program
from fiveaxis.job.solution import Solution
from fiveaxis.job.stages import LEFT_OUT, Outcome
from fiveaxis.job.unfinished import digest_job, resumable
from fiveaxis.job.verifying import verify_program

__all__ = [
    "LEFT_OUT",
    "SWEEP",
    "Gate",
    "Job",
    "MadeProgram",
    "Outcome",
    "PlacedJob",
    "PlanTable",
    "Posted",
    "ProgramEnergy",
    "ProgramOptions",
    "RevisedProgram",
    "SetupTable",
    "Solution",
    "build_job",
    "choose_search",
    "cutting_power",
    "digest_job",
    "is_mesh",
    "load_job_machine",
    "load_job_passes",
    "load_job_toolpath",
    "load_placed",
    "load_surroundings",
    "make_job",
    "make_of_motion",
    "make_program",
    "measure_plan",
    "optimise",
    "part_of",
    "part_unit",
    "post_program",
    "program_energy",
    "read_fixtures",
    "read_job",
    "require_folder",
    "resumable",
    "revise_operations",
    "revise_program",
    "run_job",
    "show_program",
    "takes_operations",
    "verify_program",
    "write_outcome",
    "write_program",
    "write_revised",
]
