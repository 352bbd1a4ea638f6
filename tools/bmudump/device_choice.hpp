// Selection of the third-party devices to decode, and of their buses.
//
//   --device NAME        its frames on every bus, in addition to those of the internal and the vehicle bus
//   --device BUS=NAME    on that bus only the devices named for it; BUS may be `any`, NAME `internal` or `vehicle`
//
// A named bus is declared: every frame with an identifier of a named device is from that device. `any` declares no bus.
//
// The second form is for devices with identifiers that bmud uses, e.g. inverters and the modules of an Outlander: they
// have their own bus, or one that they share with senders without common identifiers. Modules of another maker always
// replace those of bmud (dump_catalogue.hpp).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "devices/device.hpp"
#include "tools/bmudump/identify/dump_catalogue.hpp"

namespace bmu::dump {

struct DeviceWord {
  std::string bus;                 // empty: every bus
  const Device* device = nullptr;  // null if one of the two below is set
  bool is_internal = false;
  bool is_vehicle = false;
};

/// None if no device has that name.
[[nodiscard]] std::optional<DeviceWord> device_word_of(const std::string& text);

/// The devices to decode on that bus, and no others; the remaining fields of the choice are those of `other`.
[[nodiscard]] DumpCatalogue::Choice choice_on(const std::vector<DeviceWord>& words, const std::string& bus,
                                              const DumpCatalogue::Choice& other);
/// The devices to decode on every bus.
[[nodiscard]] std::vector<const Device*> devices_everywhere(const std::vector<DeviceWord>& words);

/// The named buses, each once, in order.
[[nodiscard]] std::vector<std::string> buses_of(const std::vector<DeviceWord>& words);

/// Output of --devices: an entry for each.
[[nodiscard]] std::string device_page();

/// Note on the module numbers in the output, if they differ from those of a pack file; else "".
[[nodiscard]] std::string numbers_note(const Device& device);

/// The value of --device that decodes this device, with the bus if necessary, and with as many of bmud's buses as are
/// compatible: "can1=sma,can1=vehicle".
[[nodiscard]] std::string working_words(const std::string& bus, const Device& device,
                                        const DumpCatalogue::Choice& other);

/// The same, always with the bus.
[[nodiscard]] std::string words_on(const std::string& bus, const Device& device, const DumpCatalogue::Choice& other);

/// Advice for an unknown device name: 'bmudump --devices lists them', preceded by the names that start with it.
[[nodiscard]] std::string device_advice(std::string_view wanted);

/// Values that --dbc accepts: bmud's buses, all chargers together, a device.
[[nodiscard]] std::vector<std::string> dbc_words();
/// Node numbers as in a pack file.
struct NodeRange {
  unsigned first = 1;
  unsigned last = 63;
  unsigned maker_less = 0;  // offset from the numbers in the rows, which are lower
};
/// The nodes of the messages of such a value; nothing: they have none.
[[nodiscard]] std::optional<NodeRange> nodes_of_dbc(const std::string& word);
/// The devices of such a value; none if it is a bus of bmud.
[[nodiscard]] std::vector<const Device*> devices_of_dbc(const std::string& word);

}  // namespace bmu::dump
