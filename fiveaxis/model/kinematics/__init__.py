"""Forward and inverse kinematics of a chain; `symbolic` has the same equations for CasADi."""
