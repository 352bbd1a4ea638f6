// The persistent state of the core as text: JSON that a person can read, with a format number and a checksum, so that a
// single lost or changed bit of the file is detected.
//
//   {"format":1,"checksum":"85944171f73967e8","content":{"faults":{"cell_overvoltage":{...}},"contactors":{...},
//                                                       "closing":{...},"modules":{"1":{"serial_number":4711}},
//                                                       "cell_charges":{...},"soc":{...},"totals":{...},"starts":3,
//                                                       "hours_since_full":12}}
//
// Faults and contactors have their names as keys: a table that grew, or was put in another order, still finds its own.
// Modules have their node numbers as keys. A file from before they were kept has none, and none is made up.
// The charge missing in the cells (state_charges.hpp) and their states of charge (state_soc.hpp) are left out when they
// are invalid, and the other parts are read nevertheless: without them balancing and the state of charge start from a
// rest of the pack; without the other parts nothing closes. The checksum is FNV-1a over `content` as it is written,
// with no spaces.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "daemon/core/records/persistent_state.hpp"
#include "protocol/result.hpp"

namespace bmu {

struct StateRead {
  PersistentState state;
  std::size_t unknown_names = 0;  // unknown faults, contactors and modules of the file: left out
  std::string charges_problem;    // why the cells' charges were left out; empty: they were not
  std::string soc_problem;        // the same for their states of charge
};

/// At most about 160 kB, ends with a line feed.
[[nodiscard]] std::string state_text(const PersistentState& state);
/// The error is for people: "the checksum is ..., of the content it is ...". Never throws; a state that is not
/// completely valid is rejected, except for the two parts above.
[[nodiscard]] Result<StateRead, std::string> parse_state(std::string_view text);

}  // namespace bmu
