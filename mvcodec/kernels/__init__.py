"""Compiled loops: the only modules that import Numba, each imported where it is first needed."""

from mvcodec.kernels.compiled_code import keep_compiled_code, on_first_compilation

# Others take it from here: two threads of which one asks for the package and one for this module of it
# would wait for each other.
__all__ = ["on_first_compilation"]

keep_compiled_code()
