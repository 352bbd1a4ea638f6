// Folders of the project's files and of its build, as the build was configured.
//
// Functions of one source instead of definitions for every test: an object then does not depend on the folder in which
// it was compiled, so that a compiler cache can use it for a clone elsewhere.
#pragma once

#include <string>
#include <string_view>

namespace bmu::test {

/// The full path of a file of the project: in_source("config/packs/demo-48s.json").
[[nodiscard]] std::string in_source(std::string_view path);

/// The full path of a file of the build: in_build("bin/bmud").
[[nodiscard]] std::string in_build(std::string_view path);

}  // namespace bmu::test
