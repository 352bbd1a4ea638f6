// Access to the chip of the emulated machine for tests, and a pack with lines on it; rig_gpio.c is its driver, with a
// debugfs that shows every level that a wire has had.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "config/pack_config.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/process.hpp"

namespace bmu::test {

inline constexpr unsigned positive_line = 3;  // active low
inline constexpr unsigned negative_line = 4;
inline constexpr unsigned precharge_line = 5;
inline constexpr unsigned watchdog_line = 2;
inline constexpr unsigned positive_contact_line = 13;  // active low
inline constexpr unsigned negative_contact_line = 14;
inline constexpr unsigned precharge_contact_line = 15;
inline constexpr unsigned estop_line = 7;
inline constexpr unsigned key_line = 9;
inline constexpr unsigned pulse_line = 22;

inline const std::string chip_folder = "/sys/kernel/debug/rig_gpio/";
inline const std::string driver_folder = "/sys/bus/platform/drivers/rig_gpio/";
// Far more than any step here takes, even in an emulated machine on a busy host.
inline constexpr int patience_ms = 20'000;

// --- the chip's file ------------------------------------------------------------------------------------------------

/// A chip that vanished while its lines were in use comes back with another number: the kernel keeps the old one. So it
/// is used by a fixed name, which a udev rule makes elsewhere.
inline const std::string chip_file = "/dev/bmud-gpio";

inline void name_chip() {
  std::filesystem::remove(chip_file);
  for (const auto& entry : std::filesystem::directory_iterator("/dev")) {
    if (entry.path().filename().string().rfind("gpiochip", 0) != 0) continue;
    std::filesystem::create_symlink(entry.path(), chip_file);
    return;
  }
  FAIL("there is no /dev/gpiochip*");
}

// --- the wires ------------------------------------------------------------------------------------------------------

inline void write_file(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  file.close();
  INFO(path);
  REQUIRE(file);
}

inline void set_wire(unsigned line, bool is_high) {
  write_file(chip_folder + "line" + std::to_string(line), is_high ? "1" : "0");
}

inline bool is_high(unsigned line) {
  const std::string text = read_file(chip_folder + "line" + std::to_string(line));
  REQUIRE((text == "0\n" || text == "1\n"));
  return text == "1\n";
}

inline bool is_closed() {
  return !is_high(positive_line) || is_high(negative_line) || is_high(precharge_line);
}

struct Driven {
  unsigned line = 0;
  int level = 0;
  std::int64_t at_us = 0;
  friend bool operator==(const Driven& a, const Driven& b) { return a.line == b.line && a.level == b.level; }
};

/// Changes of all wires since this object was made, inputs included.
class Log {
 public:
  [[nodiscard]] std::vector<Driven> news() const {
    std::vector<Driven> rows = all();
    rows.erase(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(start_));
    return rows;
  }
  [[nodiscard]] std::vector<int> levels_of(unsigned line) const {
    std::vector<int> levels;
    for (const Driven& row : news()) {
      if (row.line == line) levels.push_back(row.level);
    }
    return levels;
  }

 private:
  [[nodiscard]] static std::vector<Driven> all() {
    std::vector<Driven> rows;
    std::ifstream file(chip_folder + "log");
    REQUIRE(file);
    for (Driven row; file >> row.line >> row.level >> row.at_us;) rows.push_back(row);
    return rows;
  }
  std::size_t start_ = all().size();
};

// --- the pack -------------------------------------------------------------------------------------------------------

/// A pack file with lines, as a user would write it.
class PackFile {
 public:
  PackFile() {
    name_chip();
    const std::string packs = test::in_source("config/packs/");
    pack_ = nlohmann::json::parse(std::ifstream(packs + "demo-48s.json"), nullptr, true, true);
    pack_["cell"] = std::filesystem::path(packs) / pack_["cell"].get<std::string>();
    pack_["gpio"] = nlohmann::json::parse(R"({
      "chip": "/dev/bmud-gpio",
      "outputs": {"main_positive": {"line": 3, "active_low": true}, "main_negative": {"line": 4},
                  "precharge": {"line": 5}, "watchdog": {"line": 2}},
      "feedback": {"main_positive": {"line": 13, "active_low": true}, "main_negative": {"line": 14},
                   "precharge": {"line": 15}},
      "inputs": [{"name": "cockpit", "kind": "estop", "line": 7, "debounce_ms": 0},
                 {"name": "key", "kind": "vehicle_on", "line": 9, "debounce_ms": 0}]})");
    std::ofstream(path()) << pack_;
  }
  /// The pulses of an insulation monitor come in by a line, too; the PDU's report of it is no longer used.
  void capture_pulses() {
    pack_["gpio"]["insulation_pulses"] = {{"line", pulse_line}};
    std::ofstream(path()) << pack_;
  }
  [[nodiscard]] std::string path() const { return folder_ / "pack.json"; }
  [[nodiscard]] GpioConfig lines() const {
    const auto pack = load_pack_config(path());
    REQUIRE(pack);
    return *pack->gpio;
  }

 private:
  TemporaryFolder folder_;
  nlohmann::json pack_;
};

}  // namespace bmu::test
