// Faults that a real daemon reports because of the machine, not of its pack: a test machine is shared, and slow with
// sanitizers. Tests of the faults of the pack ignore them where the machine may be their cause.
#pragma once

#include <chrono>
#include <cstdint>
#include <fstream>
#include <string>

#include <nlohmann/json.hpp>
#include <unistd.h>

#include "daemon/core/core.hpp"
#include "tests/support/sanitized.hpp"

namespace bmu::test {

/// CPU time that the hypervisor gave to other machines while this one had work, over all processors, since boot.
[[nodiscard]] inline std::chrono::nanoseconds stolen_time() {
  std::ifstream file("/proc/stat");
  std::string word;
  std::int64_t ticks = 0;
  // "cpu user nice system idle iowait irq softirq steal"
  file >> word;
  for (int column = 0; column < 8; ++column) file >> ticks;
  return std::chrono::nanoseconds(std::chrono::seconds(file ? ticks : 0)) / ::sysconf(_SC_CLK_TCK);
}

/// At the start of the test program.
inline const std::chrono::nanoseconds stolen_before = stolen_time();

/// Whether the first thread of this process, in the daemon the control loop, may have been late without a fault of its
/// own: it has waited for a processor, or the machine for one, for at least `tick_late`. The kernel reports the sum
/// over the whole process, not the longest wait, so false is returned only where a delay is excluded; true where the
/// kernel reports nothing, and with a sanitizer, which slows the process down.
[[nodiscard]] inline bool may_have_been_kept_waiting(pid_t process) {
  std::int64_t ran_ns = 0;
  std::int64_t waited_ns = 0;
  std::ifstream file("/proc/" + std::to_string(process) + "/schedstat");
  if (is_sanitized || !(file >> ran_ns >> waited_ns)) return true;
  return std::chrono::nanoseconds(waited_ns) + (stolen_time() - stolen_before) >= tick_late;
}

/// Whether the machine alone may be the cause of a fault of this name: decisions came late or stopped for some time, or
/// frames were not read in time, if the machine `may_be_busy`; or a sanitizer keeps memory.
[[nodiscard]] inline bool may_be_of_the_machine(const std::string& fault_name, bool may_be_busy) {
  const bool is_of_busy =
      fault_name == "tick_overrun" || fault_name == "control_loop_gap" || fault_name == "frames_lost";
  return (is_of_busy && may_be_busy) || (is_sanitized && fault_name == "memory_low");
}

/// `faults`, an array of names or of objects with a "name" as the status socket sends them, without those of the
/// machine.
[[nodiscard]] inline nlohmann::json of_the_pack(const nlohmann::json& faults, bool may_be_busy) {
  nlohmann::json kept = nlohmann::json::array();
  for (const nlohmann::json& fault : faults) {
    const auto name = (fault.is_object() ? fault.at("name") : fault).get<std::string>();
    if (!may_be_of_the_machine(name, may_be_busy)) kept.push_back(fault);
  }
  return kept;
}

/// The present faults that the daemon of this bench reports, without those that the machine alone may have caused.
template <class Made>
[[nodiscard]] nlohmann::json faults_of_the_pack(const Made& bench) {
  const nlohmann::json present = bench.ask_json("status").at("faults_present");
  return of_the_pack(present, may_have_been_kept_waiting(bench.daemon->pid()));
}

/// Whether faults of the machine clear: at some point none is left, after a clear if one is needed.
template <class Made>
[[nodiscard]] bool faults_of_the_machine_pass(Made& bench) {
  const auto has_none = [&bench] {
    const nlohmann::json present = bench.ask_json("status").at("faults_present");
    return of_the_pack(present, true) == of_the_pack(present, false);
  };
  return has_none() || bench.becomes([&] {
    static_cast<void>(bench.ask({"clear"}));
    return has_none();
  });
}

}  // namespace bmu::test
