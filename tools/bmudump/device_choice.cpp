#include "tools/bmudump/device_choice.hpp"

#include <algorithm>

#include "devices/device_list.hpp"
#include "tools/bmudump/words.hpp"

namespace bmu::dump {
namespace {

constexpr std::string_view own_internal = "internal";
constexpr std::string_view own_vehicle = "vehicle";
constexpr std::string_view all_chargers = "charger";

/// "250 or 500 kbit/s".
std::string bit_rate_text(std::span<const std::uint32_t> rates) {
  std::string text;
  for (const std::uint32_t rate : rates) {
    if (!text.empty()) text += " or ";
    text += std::to_string(rate / 1'000);
  }
  return text + " kbit/s";
}

/// The buses of bmud that are decoded together with a device.
struct Beside {
  bool with_internal = false;
  bool with_vehicle = false;
};

bool has_clash(const Device& device, const Beside& beside, const DumpCatalogue::Choice& other) {
  DumpCatalogue::Choice choice = other;
  choice.devices = {&device};
  choice.has_internal = beside.with_internal;
  choice.has_vehicle = beside.with_vehicle;
  return DumpCatalogue(choice).clash().has_value();
}

}  // namespace

std::optional<DeviceWord> device_word_of(const std::string& text) {
  const std::size_t sign = text.find('=');
  const bool has_bus = sign != std::string::npos;
  const std::string name = has_bus ? text.substr(sign + 1) : text;
  DeviceWord word{.bus = has_bus ? text.substr(0, sign) : "",
                  .device = find_device(name),
                  .is_internal = has_bus && name == own_internal,
                  .is_vehicle = has_bus && name == own_vehicle};
  const bool is_known = word.device != nullptr || word.is_internal || word.is_vehicle;
  return is_known && sign != 0 ? std::optional(std::move(word)) : std::nullopt;
}

DumpCatalogue::Choice choice_on(const std::vector<DeviceWord>& words, const std::string& bus,
                                const DumpCatalogue::Choice& other) {
  DumpCatalogue::Choice choice = other;
  choice.devices.clear();
  choice.has_internal = choice.has_vehicle = false;
  for (const DeviceWord& word : words) {
    if (word.bus != bus) continue;
    choice.has_internal = choice.has_internal || word.is_internal;
    choice.has_vehicle = choice.has_vehicle || word.is_vehicle;
    if (word.device != nullptr) choice.devices.push_back(word.device);
  }
  return choice;
}

std::vector<const Device*> devices_everywhere(const std::vector<DeviceWord>& words) {
  std::vector<const Device*> devices;
  for (const DeviceWord& word : words) {
    if (word.bus.empty()) devices.push_back(word.device);
  }
  return devices;
}

std::vector<std::string> buses_of(const std::vector<DeviceWord>& words) {
  std::vector<std::string> buses;
  for (const DeviceWord& word : words) {
    const bool is_known = std::find(buses.begin(), buses.end(), word.bus) != buses.end();
    if (!word.bus.empty() && !is_known) buses.push_back(word.bus);
  }
  return buses;
}

std::string device_page() {
  std::string page;
  for (const Device* device : all_devices()) {
    const std::string kind(to_text(device->kind));
    page += formatted("%-20s %s\n%-20s   %s, %s: %s\n", std::string(device->name).c_str(),
                      std::string(device->title).c_str(), "", kind.c_str(), bit_rate_text(device->bit_rates).c_str(),
                      std::string(device->meaning).c_str());
    const std::string note = numbers_note(*device);
    if (!note.empty()) page += formatted("%-20s   %s\n", "", note.c_str());
  }
  return page;
}

std::string numbers_note(const Device& device) {
  if (device.modules == nullptr || device.modules->maker_less == 0) return "";
  return "Numbers are its maker's: number n is node n + " + std::to_string(device.modules->maker_less) +
         " of a pack file and of bmuctl";
}

std::string working_words(const std::string& bus, const Device& device, const DumpCatalogue::Choice& other) {
  return has_clash(device, {.with_internal = true, .with_vehicle = true}, other) ? words_on(bus, device, other)
                                                                                 : std::string(device.name);
}

std::string words_on(const std::string& bus, const Device& device, const DumpCatalogue::Choice& other) {
  constexpr Beside in_order[] = {
      {.with_internal = true, .with_vehicle = true}, {.with_internal = true}, {.with_vehicle = true}, {}};
  const auto* const beside = std::find_if(std::begin(in_order), std::end(in_order) - 1,
                                          [&](const Beside& one) { return !has_clash(device, one, other); });
  const auto word = [&bus](std::string_view name) { return bus + "=" + std::string(name); };
  return word(device.name) + (beside->with_internal ? "," + word(own_internal) : "") +
         (beside->with_vehicle ? "," + word(own_vehicle) : "");
}

std::string device_advice(std::string_view wanted) {
  std::string near;
  for (const Device* device : all_devices()) {
    const bool is_near = !wanted.empty() && device->name.starts_with(wanted);
    if (is_near) near.append(near.empty() ? "" : " or ").append(device->name);
  }
  const std::string question = near.empty() ? "" : "did you mean " + near + "? ";
  return question + "bmudump --devices lists them";
}

std::vector<std::string> dbc_words() {
  std::vector<std::string> words{std::string(own_internal), std::string(own_vehicle), std::string(all_chargers)};
  for (const Device* device : all_devices()) words.emplace_back(device->name);
  return words;
}

std::optional<NodeRange> nodes_of_dbc(const std::string& word) {
  const std::vector<const Device*> devices = devices_of_dbc(word);
  if (devices.empty()) return NodeRange{};
  NodeRange range{.last = 0};
  for (const Device* device : devices) {
    range.maker_less = device->modules == nullptr ? 0 : device->modules->maker_less;
    for (const MessageSpec* message : device->catalogue->messages()) {
      if (message->has_node()) range.last = std::max<unsigned>(range.last, message->node_max + range.maker_less);
    }
  }
  return range.last == 0 ? std::nullopt : std::optional(range);
}

std::vector<const Device*> devices_of_dbc(const std::string& word) {
  std::vector<const Device*> devices;
  for (const Device* device : all_devices()) {
    const bool is_meant = word == all_chargers ? device->kind == DeviceKind::charger : device->name == word;
    if (is_meant) devices.push_back(device);
  }
  return devices;
}

}  // namespace bmu::dump
