// The tables of docs/bus-protocol.md, generated from the rows that the codecs use.
#pragma once

#include <string>

#include "tools/bmudump/device_choice.hpp"
#include "tools/bmudump/identify/dump_catalogue.hpp"

namespace bmu::dump {

/// Markdown: one heading and one table per message. `own` has both buses of bmud.
[[nodiscard]] std::string protocol_doc(const DumpCatalogue& own);
/// The same for the devices named by these words, in their order, whatever bus is given with them.
[[nodiscard]] std::string device_doc(const std::vector<DeviceWord>& words, const DumpCatalogue& own,
                                     bool sensor_little_endian);

}  // namespace bmu::dump
