"""The motions that a result is compared with, also where a mask refuses some of their postures."""

from fiveaxis.posture.baselines.branches import INSIDE as INSIDE
from fiveaxis.posture.baselines.branches import follow_axes as follow_axes
from fiveaxis.posture.baselines.branches import nearest_held as nearest_held
from fiveaxis.posture.baselines.branches import nearest_to_reference as nearest_to_reference
from fiveaxis.posture.baselines.branches import postures as postures
from fiveaxis.posture.baselines.branches import require_blocks as require_blocks
from fiveaxis.posture.baselines.catalogue import as_programmed as as_programmed
from fiveaxis.posture.baselines.catalogue import find_baselines as find_baselines
from fiveaxis.posture.baselines.catalogue import leaned as leaned
from fiveaxis.posture.baselines.clear import moved_clear as moved_clear
