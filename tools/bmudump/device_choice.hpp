// Which foreign devices are read, and where.
//
//   --device NAME        its frames on every bus, beside those of the internal and the vehicle bus
//   --device BUS=NAME    on that bus nothing but what is named for it; BUS may be `any`, NAME `internal` or `vehicle`
//
// A bus that is named is declared: what has the identifiers is what was named. `any` declares none.
//
// The second is for devices that have identifiers of ours, as inverters have and the modules of an Outlander: they have
// a bus of their own, or one that they share with what they have none in common with. Modules of another maker are
// always read in the place of ours (dump_catalogue.hpp).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "devices/device.hpp"
#include "tools/bmudump/identify/dump_catalogue.hpp"

namespace bmu::dump {

struct DeviceWord {
  std::string bus;                 // empty: every bus
  const Device* device = nullptr;  // or null, and it is
  bool is_internal = false;
  bool is_vehicle = false;
};

/// None if there is no device of that name.
[[nodiscard]] std::optional<DeviceWord> device_word_of(const std::string& text);

/// What is read on that bus and nothing else, the rest of the choice as in `other`.
[[nodiscard]] DumpCatalogue::Choice choice_on(const std::vector<DeviceWord>& words, const std::string& bus,
                                              const DumpCatalogue::Choice& other);
/// The devices read on every bus.
[[nodiscard]] std::vector<const Device*> devices_everywhere(const std::vector<DeviceWord>& words);

/// The buses that are named, each once, in order.
[[nodiscard]] std::vector<std::string> buses_of(const std::vector<DeviceWord>& words);

/// For --devices: a line for each.
[[nodiscard]] std::string device_page();

/// How this device's modules are numbered in what is printed, where it is not as in a pack file; else "".
[[nodiscard]] std::string numbers_note(const Device& device);

/// What behind --device reads it, on that bus if need be, with as much of ours as goes together:
/// "can1=sma,can1=vehicle".
[[nodiscard]] std::string working_words(const std::string& bus, const Device& device,
                                        const DumpCatalogue::Choice& other);

/// The same with the bus in any case.
[[nodiscard]] std::string words_on(const std::string& bus, const Device& device, const DumpCatalogue::Choice& other);

/// What to say to who named a device that there is none of: 'bmudump --devices lists them', with those whose names
/// begin so.
[[nodiscard]] std::string device_advice(std::string_view wanted);

/// What --dbc may print: buses of ours, all chargers together, a device.
[[nodiscard]] std::vector<std::string> dbc_words();
/// Nodes as a pack file counts them.
struct NodeRange {
  unsigned first = 1;
  unsigned last = 63;
  unsigned maker_less = 0;  // the numbers in the rows are this much lower
};
/// Those that the messages behind such a word can have; nothing: they have none.
[[nodiscard]] std::optional<NodeRange> nodes_of_dbc(const std::string& word);
/// The devices behind such a word; none if it is a bus of ours.
[[nodiscard]] std::vector<const Device*> devices_of_dbc(const std::string& word);

}  // namespace bmu::dump
