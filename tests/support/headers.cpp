// The source of a library that has nothing but precompiled headers; CMake wants one.
