// The source of a library of precompiled headers only; CMake requires one.
