"""The motions that a result is compared with, also where a mask refuses some of their postures."""
