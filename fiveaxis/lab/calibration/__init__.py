"""Drive powers fitted to logs of motions."""
