// The core's persistent state as text: JSON that a person can read, with a format number and a checksum, so that a file
// that lost or changed a single bit is noticed.
//
//   {"format":1,"checksum":"85944171f73967e8","content":{"faults":{"cell_overvoltage":{...}},"contactors":{...},
//                                                      "closing":{...},"modules":{"1":{"serial_number":4711}},
//                                                      "cell_charges":{...},"soc":{...}}}
//
// Faults and contactors stand under their names: a table that grew, or was put in another order, still finds its own.
// Modules stand under their node numbers. A file from before they were kept knows none, and none is made up.
// What was missing in the cells (state_charges.hpp) and their states of charge (state_soc.hpp) are left out when they
// are not right, and the rest is read all the same: without them balancing and the state of charge begin from a rest,
// without the rest nothing closes. The checksum is FNV-1a over `content` as it is written here, without spaces.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "daemon/core/records/persistent_state.hpp"
#include "protocol/result.hpp"

namespace bmu {

struct StateRead {
  PersistentState state;
  std::size_t unknown_names = 0;  // faults and contactors of the file that this program does not know: left out
  std::string charges_problem;    // why the cells' charges were left out; empty: they were not
  std::string soc_problem;        // and their states of charge
};

/// At most about 160 kB, ends with a line feed.
[[nodiscard]] std::string state_text(const PersistentState& state);
/// The error says what is wrong, for people: "the checksum is ..., of the content it is ...". Never throws; a state
/// that is not wholly right is none at all.
[[nodiscard]] Result<StateRead, std::string> parse_state(std::string_view text);

}  // namespace bmu
