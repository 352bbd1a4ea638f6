// The tables of docs/bus-protocol.md, made from the rows the codecs use.
#pragma once

#include <string>

#include "tools/bmudump/device_choice.hpp"
#include "tools/bmudump/identify/dump_catalogue.hpp"

namespace bmu::dump {

/// Markdown: one heading and one table a message. `own` has both buses of ours.
[[nodiscard]] std::string protocol_doc(const DumpCatalogue& own);
/// The same of what these words name, in their order, whatever bus they name with it.
[[nodiscard]] std::string device_doc(const std::vector<DeviceWord>& words, const DumpCatalogue& own,
                                     bool sensor_little_endian);

}  // namespace bmu::dump
