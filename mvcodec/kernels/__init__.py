"""Compiled loops: the only modules that import Numba, each imported where it is first needed."""

from mvcodec.kernels.compiled_code import keep_compiled_code

keep_compiled_code()
