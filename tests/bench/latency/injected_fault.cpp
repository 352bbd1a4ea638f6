#include "tests/bench/latency/injected_fault.hpp"

#include <filesystem>
#include <fstream>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "daemon/core/core.hpp"
#include "daemon/core/faults/fault_table.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu::latency {

namespace {

constexpr std::int32_t excess_mV = 10;
constexpr std::int32_t uV_per_mV = 1000;

static_assert(confirm_max < ask_again_after, "a confirm time that is over when the second sample arrives");

}  // namespace

std::string_view to_text(FaultChoice fault) {
  return fault == FaultChoice::emergency_stop ? "emergency_stop" : "cell_overvoltage";
}

std::string pack_for(FaultChoice fault, const std::string& file, const std::string& folder) {
  const auto pack = load_pack_config(file);
  if (!pack) throw std::runtime_error(to_text(pack.error().front()));
  if (fault == FaultChoice::emergency_stop || pack->core.limits.cell_overvoltage.confirm <= confirm_max) return file;
  auto json = nlohmann::ordered_json::parse(pack->sources.pack_text, nullptr, true, true);
  json.erase("$schema");
  if (json["cell"].is_string()) {
    const std::filesystem::path here = std::filesystem::absolute(file).parent_path();
    json["cell"] = (here / json["cell"].get<std::string>()).string();
  }
  json["limits"]["cell_overvoltage"]["confirm_ms"] = to_ms(confirm_max);
  const std::filesystem::path copy = std::filesystem::path(folder) / (std::string(to_text(fault)) + ".json");
  std::ofstream out(copy);
  out << json.dump(2) << std::flush;
  if (!out) throw std::runtime_error("not writable: " + copy.string());
  return copy.string();
}

InjectedFault::InjectedFault(FaultChoice fault, const CoreConfig& pack, RandomSource& random) : fault_(fault) {
  if (fault == FaultChoice::emergency_stop) {
    event_ = "estop 1 pressed";
    return;
  }
  const ModuleConfig& module = pack.modules[random.next() % pack.modules.size()];
  node_ = module.node;
  cell_ = random.next() % module.cell_count;
  threshold_uV_ = pack.limits.cell_overvoltage.open;
  confirm_ = pack.limits.cell_overvoltage.confirm;
  samples_needed_ = row_of(FaultId::cell_overvoltage).samples;
  event_ = "cell " + std::to_string(node_) + "." + std::to_string(cell_ + 1) + " voltage_mV " +
           std::to_string(threshold_uV_ / uV_per_mV + excess_mV);
}

/// A module sends one CELLS frame of the cell for each POLL, so every frame that shows the fault is another sample.
InjectedFault::Effect InjectedFault::effect_of(const CanFrame& frame, TimePoint written_at) {
  if (samples_ >= samples_needed_ || !shows_fault(frame)) return Effect::none;
  if (samples_ == 0) first_at_ = written_at;
  ++samples_;
  if (samples_ < samples_needed_) return Effect::none;
  return written_at - first_at_ >= confirm_ ? Effect::completes : Effect::completes_too_soon;
}

bool InjectedFault::shows_fault(const CanFrame& frame) const {
  if (fault_ == FaultChoice::emergency_stop) {
    return frame.id == internal_bus::pdu_status.base_id &&
           read_raw<internal_bus::pdu_status, "estop_1_released">(frame) == 0;
  }
  const MessageSpec& row = *internal_bus::cells_rows[cell_ / internal_bus::cells_per_frame];
  if (frame.id != row.id_of(node_)) return false;
  const SignalValue voltage = decode_signal(row.signals[cell_ % internal_bus::cells_per_frame], frame.data);
  return voltage.is_valid() && voltage.value >= threshold_uV_;
}

}  // namespace bmu::latency
