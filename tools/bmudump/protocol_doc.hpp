// The tables of docs/bus-protocol.md, made from the rows the codecs use.
#pragma once

#include <string>

#include "tools/bmudump/dump_catalogue.hpp"

namespace bmu::dump {

/// Markdown: one heading and one table a message.
[[nodiscard]] std::string protocol_doc(const DumpCatalogue& catalogue);

}  // namespace bmu::dump
