"""An independent check of motions and programs, with other kinematics than the optimiser's."""
