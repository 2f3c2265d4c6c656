"""The tool, the cutter locations, and the constraints on the tool's posture there."""

from fiveaxis.model.toolpath import shapes as shapes
