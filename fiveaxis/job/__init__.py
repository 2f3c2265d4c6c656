"""One job: from a part or a path to the files that a machine and its programmer need."""

from fiveaxis.job.blocks import RESULT, ProgramMotion, program_motion
from fiveaxis.job.clearing import optimise
from fiveaxis.job.description import SWEEP, Job, PlanTable, SetupTable
from fiveaxis.job.posting import Posted, post_program
from fiveaxis.job.programs import ProgramEnergy, program_energy
from fiveaxis.job.reading import build_job, make_job, read_fixtures, read_job
from fiveaxis.job.results import compose_outcome, require_folder, write_outcome
from fiveaxis.job.setting_up import choose_search, run_job
from fiveaxis.job.stages import (
    Outcome,
    is_mesh,
    load_job_machine,
    load_job_toolpath,
    measure_plan,
    part_of,
)
from fiveaxis.job.verifying import verify_program

__all__ = [
    "RESULT",
    "SWEEP",
    "Job",
    "Outcome",
    "PlanTable",
    "Posted",
    "ProgramEnergy",
    "ProgramMotion",
    "SetupTable",
    "build_job",
    "choose_search",
    "compose_outcome",
    "is_mesh",
    "load_job_machine",
    "load_job_toolpath",
    "make_job",
    "measure_plan",
    "optimise",
    "part_of",
    "post_program",
    "program_energy",
    "program_motion",
    "read_fixtures",
    "read_job",
    "require_folder",
    "run_job",
    "verify_program",
    "write_outcome",
]
