// The state file on a real disk: torn, truncated, bit-flipped, of an older and a newer program, on a full disk.
#include "daemon/shell/state/state_store.hpp"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <sys/stat.h>

#include "daemon/shell/state/state_text.hpp"
#include "daemon/shell/status/user_names.hpp"
#include "protocol/fnv.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/process.hpp"
#include "tests/support/sanitized.hpp"

namespace bmu {
namespace {

using Json = nlohmann::ordered_json;

std::size_t index_of(FaultId id) {
  return static_cast<std::size_t>(id);
}

/// A distinct value in every field of every record.
PersistentState full_state() {
  PersistentState state;
  FaultRecord& fault = state.faults[index_of(FaultId::cell_deep_discharge)];
  fault = {.count = 4'000'000'000,
           .first_unix_time_ms = 1'700'000'000'123,
           .last_unix_time_ms = 1'700'000'100'456,
           .is_locked = true,
           .cleared = ClearRecord{.unix_time_ms = 1'700'000'200'789, .user_id = 1'000, .authority = Authority::service},
           .frame = FreezeFrame{.unix_time_ms = 1'700'000'100'457,
                                .value = -5'000'000'000,
                                .threshold = 5'000'000'001,
                                .element = {.module_node = 63,
                                            .number = 12,
                                            .pack_number = 756,
                                            .is_temperature_sensor = true,
                                            .contactor = 4,
                                            .input = 3},
                                .phase = Phase::breaking,
                                .mode = PackMode::charge_only,
                                .cell_voltage_min_uV = 1,
                                .cell_voltage_max_uV = 2,
                                .cell_voltage_average_uV = 3,
                                .cell_voltage_min_at = {.module_node = 1},
                                .cell_voltage_max_at = {.module_node = 2},
                                .cell_voltage_sum_mV = 17,
                                .module_voltage_sum_mV = 18,
                                .cell_temperature_min_dC = -400,
                                .cell_temperature_max_dC = 5,
                                .cell_temperature_average_dC = 6,
                                .cell_temperature_min_at = {.module_node = 3},
                                .cell_temperature_max_at = {.module_node = 4},
                                .board_temperature_min_dC = 19,
                                .board_temperature_max_dC = 7,
                                .board_temperature_min_at = {.module_node = 5},
                                .board_temperature_max_at = {.module_node = 6},
                                .pack_voltage_mV = 8,
                                .link_voltage_mV = 9,
                                .link_time_constant_ms = 110'000,
                                .current_mA = -10,
                                .current_2_mA = 20,
                                .soc_permille = 11,
                                .insulation_Ohm = 12,
                                .discharge_limit_mA = 13,
                                .charge_limit_mA = 14,
                                .discharge_overload_permille = 15,
                                .charge_overload_permille = 16,
                                .outputs = ContactorOutputs{.main_negative = true, .charge = true, .heater = true},
                                .inputs = PduState{.main_negative_closed = true,
                                                   .opened_by_timeout = true,
                                                   .alarm_loop_open = true,
                                                   .vehicle_on = true,
                                                   .estop_1_released = true,
                                                   .interlock_closed = true,
                                                   .resume_button = true,
                                                   .supply_ok = false,
                                                   .estops_pressed = 0b101,
                                                   .interlocks_open = 0b10,
                                                   .insulation_state = InsulationState::earth_fault,
                                                   .insulation_resistance_Ohm = known(1'000'000'007),
                                                   .throttle_permille = not_known(Validity::above_range)}}};
  state.faults[index_of(FaultId::module_lost)] = {.count = 1, .frame = FreezeFrame{.current_mA = std::nullopt}};
  state.contactors[0] = {.closings = 1,
                         .openings = 2,
                         .openings_under_load = 3,
                         .current_broken_max_mA = 4,
                         .current_broken_sum_mA = 5'000'000'000};
  state.contactors[3] = {.closings = 7};
  state.closing = {.precharge = {.heat_uJ = 6'000'000'000, .last_try_uJ = 7, .tries_failed = 2}, .lockout_ms = 10'000};
  state.modules[1] = {.is_known = true, .serial_number = 0};
  state.modules[63] = {.is_known = true, .serial_number = 0xFFFF'FFFF};
  state.cell_charges = {.unix_time_ms = 1'700'000'300'000, .capacity_uAs = 360'000'000'000};
  state.cell_charges.modules[1] = {.cell_count = 2, .serial_number = 0, .cells = {{{-8, 9}, {10'000'000'000, 0}}}};
  state.cell_charges.modules[63] = {.cell_count = 1, .serial_number = 0xFFFF'FFFF, .cells = {{{11, 12}}}};
  state.totals = {
      .charge_out_uAs = 11, .charge_in_uAs = 12, .energy_out_mWh = 13, .energy_in_mWh = std::int64_t{1} << 60};
  state.starts = 4'294'967'295;
  state.hours_since_full = 719;
  state.soc = {.is_kept = true,
               .is_last = true,
               .unix_time_ms = 1'700'000'300'001,
               .capacity_uAs = 360'000'000'000,
               .told_ppm = 612'345};
  ModuleSocRecord& soc = state.soc.modules[63];
  soc.cell_count = 2;
  soc.serial_number = 4'294'967'295;
  soc.cells[0] = {.soc_ppm = 1'000'000,
                  .sigma_ppm = 1,
                  .hysteresis_permille = -1'000,
                  .health = {900'000, 5'000, 1'300'000, 40'000}};
  soc.cells[1] = {.soc_ppm = 0, .sigma_ppm = 1'000'000, .hysteresis_permille = 1'000};
  return state;
}

/// The text with modified content, and a matching checksum.
std::string changed(const PersistentState& state, const std::function<void(Json&)>& change) {
  Json file = Json::parse(state_text(state));
  change(file);
  char hex[20];
  std::snprintf(hex, sizeof(hex), "%016llx",
                static_cast<unsigned long long>(continue_fnv(fnv_start, file["content"].dump())));
  file["checksum"] = hex;
  return file.dump();
}

std::string problem_of(const std::string& text) {
  const auto read = parse_state(text);
  return read ? "" : read.error();
}

void put_text(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

/// The text that was read, and the problems of others.
struct Found {
  FileFound found = FileFound::nothing;
  std::string text;
  std::string problems;
};

/// Texts that start with "good" are valid.
Found read(StateFile& file) {
  Found found;
  const auto take = [&found](std::string_view text) -> Result<void, std::string> {
    if (!text.starts_with("good")) return failure(std::string("not good"));
    found.text = text;
    return {};
  };
  found.found = file.read(take, found.problems);
  return found;
}
Found read(const std::string& path) {
  StateFile file(path);
  return read(file);
}

/// While this object exists, no file of this process grows beyond `bytes`: simulates a full disk.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    REQUIRE(::getrlimit(RLIMIT_FSIZE, &before_) == 0);
    static_cast<void>(std::signal(SIGXFSZ, SIG_IGN));
    const rlimit limit{.rlim_cur = bytes, .rlim_max = before_.rlim_max};
    REQUIRE(::setrlimit(RLIMIT_FSIZE, &limit) == 0);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  ~FullDisk() { ::setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

std::unique_ptr<StateStore> open_store(const StateStoreOptions& options) {
  auto store = StateStore::open(options);
  REQUIRE(store);
  return std::move(*store);
}

}  // namespace

// --- the text -------------------------------------------------------------------------------------------------------

TEST_CASE("a state comes back from its text with every field", "[integration][state]") {
  const auto read = parse_state(state_text(full_state()));
  INFO((read ? "" : read.error()));
  REQUIRE(read);
  CHECK(read->state == full_state());
  CHECK(read->unknown_names == 0);
  const auto empty = parse_state(state_text({}));
  REQUIRE(empty);
  CHECK(empty->state == PersistentState{});
}

TEST_CASE("no flipped bit of a state text goes unnoticed", "[integration][state][F76][slow]") {
  const PersistentState state = full_state();
  const std::string good = state_text(state);
  for (std::size_t at = 0; at < good.size(); ++at) {
    // One bit per byte with a sanitizer, which checks how the text is read: all take minutes there. A build without
    // tries all of them.
    for (unsigned bit = test::is_sanitized ? at % 8 : 0; bit < 8; bit += test::is_sanitized ? 8 : 1) {
      std::string text = good;
      text[at] = static_cast<char>(static_cast<unsigned char>(text[at]) ^ (1U << bit));
      const auto read = parse_state(text);
      // The line feed at the end may become another space: the content is complete then.
      if (read && read->state == state && at + 1 == good.size()) continue;
      if (!read) continue;
      FAIL_CHECK("bit " << bit << " of byte " << at << " was not noticed: " << text.substr(at > 20 ? at - 20 : 0, 40));
    }
  }
}

TEST_CASE("a state text that was cut off is refused at every length", "[integration][state][F76]") {
  const std::string good = state_text(full_state());
  // Every third length with a sanitizer; see above.
  for (std::size_t length = 0; length + 1 < good.size(); length += test::is_sanitized ? 3 : 1) {
    if (parse_state(good.substr(0, length))) FAIL_CHECK("accepted at " << length << " of " << good.size());
  }
}

TEST_CASE("names a program does not know are left out and counted, the others are kept", "[integration][state]") {
  const PersistentState state = full_state();
  const std::string text = changed(state, [](Json& file) {
    file["content"]["faults"]["of_tomorrow"] = {{"count", 1}};
    file["content"]["contactors"]["second_string"] = nullptr;
  });
  const auto read = parse_state(text);
  REQUIRE(read);
  CHECK(read->unknown_names == 2);
  CHECK(read->state == state);
  // A fault that is missing in the file has never occurred.
  const auto less = parse_state(changed(state, [](Json& file) { file["content"]["faults"].erase("module_lost"); }));
  REQUIRE(less);
  CHECK(less->state.faults[index_of(FaultId::module_lost)] == FaultRecord{});
}

TEST_CASE("a file of before modules were kept knows none, and a node that is none is left out",
          "[integration][state]") {
  const PersistentState state = full_state();
  const auto before = parse_state(changed(state, [](Json& file) { file["content"].erase("modules"); }));
  REQUIRE(before);
  CHECK(before->state.modules == KnownModules{});
  const auto strange = parse_state(changed(state, [](Json& file) {
    for (const char* node : {"0", "64", "x", "1x", ""}) file["content"]["modules"][node] = {{"serial_number", 1}};
  }));
  REQUIRE(strange);
  CHECK(strange->unknown_names == 5);
  CHECK(strange->state == state);
  CHECK_FALSE(parse_state(changed(state, [](Json& file) {
    file["content"]["modules"]["1"] = {{"serial_number", -1}};
  })));
  CHECK_FALSE(parse_state(changed(state, [](Json& file) { file["content"]["modules"]["1"] = Json::object(); })));
}

TEST_CASE("a file of before the cells' charges were kept has none, charges that are not right are left out alone",
          "[integration][state]") {
  const PersistentState state = full_state();
  PersistentState without = state;
  without.cell_charges = {};
  const auto before = parse_state(changed(state, [](Json& file) { file["content"].erase("cell_charges"); }));
  REQUIRE(before);
  CHECK(before->state == without);
  CHECK(before->charges_problem.empty());
  const auto problem = [&](const std::string& pointer, const Json& value) {
    const auto read = parse_state(
        changed(state, [&](Json& file) { file[Json::json_pointer("/content/cell_charges" + pointer)] = value; }));
    REQUIRE(read);
    CHECK(read->state == without);
    return read->charges_problem;
  };
  CHECK(problem("", 5) == "cell_charges/unix_time_ms is null, expected milliseconds since 1970");
  CHECK(problem("/unix_time_ms", 0) == "cell_charges/unix_time_ms is 0, expected milliseconds since 1970");
  CHECK(problem("/capacity_uAs", -1) == "cell_charges/capacity_uAs is -1, expected a charge above 0");
  CHECK(problem("/modules", Json::array()) == "cell_charges/modules is [], expected modules by their node numbers");
  CHECK(problem("/modules/64", Json::object()) == "cell_charges/modules/64 is not a node number, expected 1 to 63");
  CHECK(problem("/modules/1/serial_number", 4'294'967'296) ==
        "cell_charges/modules/1/serial_number is 4294967296, expected 0 to 4294967295");
  CHECK(problem("/modules/1/cells_uAs", Json::array()) ==
        "cell_charges/modules/1/cells_uAs is [], expected 1 to 12 cells");
  const char* const pair = ", expected two charges, the second not below 0";
  CHECK(problem("/modules/1/cells_uAs/1", {1, -1}) ==
        std::string("cell_charges/modules/1/cells_uAs/1 is [1,-1]") + pair);
  CHECK(problem("/modules/1/cells_uAs/0", {1.5, 1}) ==
        std::string("cell_charges/modules/1/cells_uAs/0 is [1.5,1]") + pair);
  CHECK(problem("/modules/1/cells_uAs/0", {1, 18'446'744'073'709'551'615U}) ==
        std::string("cell_charges/modules/1/cells_uAs/0 is [1,18446744073709551615]") + pair);
}

TEST_CASE("states of charge that are not right are left out alone", "[integration][state]") {
  const PersistentState state = full_state();
  PersistentState without = state;
  without.soc = {};
  const auto before = parse_state(changed(state, [](Json& file) { file["content"].erase("soc"); }));
  REQUIRE(before);
  CHECK(before->state == without);
  CHECK(before->soc_problem.empty());
  const auto read_with = [&](const std::string& pointer, const Json& value) {
    return parse_state(changed(state, [&](Json& file) { file[Json::json_pointer("/content/soc" + pointer)] = value; }));
  };
  const auto problem = [&](const std::string& pointer, const Json& value) {
    const auto read = read_with(pointer, value);
    REQUIRE(read);
    CHECK(read->state == without);
    CHECK(read->charges_problem.empty());
    return read->soc_problem;
  };
  CHECK(problem("", 5) == "soc/unix_time_ms is null, expected milliseconds since 1970, or 0");
  CHECK(problem("/unix_time_ms", -1) == "soc/unix_time_ms is -1, expected milliseconds since 1970, or 0");
  CHECK(problem("/capacity_uAs", 0) == "soc/capacity_uAs is 0, expected a charge above 0");
  CHECK(problem("/is_last", 1) == "soc/is_last is 1, expected true or false");
  CHECK(problem("/told_ppm", 1'000'001) == "soc/told_ppm is 1000001, expected 0 to 1000000");
  CHECK(problem("/told_ppm", 0.5) == "soc/told_ppm is 0.5, expected 0 to 1000000");
  CHECK(problem("/modules", Json::array()) == "soc/modules is [], expected modules by their node numbers");
  CHECK(problem("/modules/64", Json::object()) == "soc/modules/64 is not a node number, expected 1 to 63");
  CHECK(problem("/modules/63/serial_number", 4'294'967'296) ==
        "soc/modules/63/serial_number is 4294967296, expected 0 to 4294967295");
  CHECK(problem("/modules/63/cells", Json::array()) == "soc/modules/63/cells is [], expected 1 to 12 cells");
  CHECK(problem("/modules/63/cells", Json(std::vector<int>(13, 0))) ==
        "soc/modules/63/cells is [0,0,0,0,0,0,0,0,0,0,0,0,0], expected 1 to 12 cells");
  const char* const triple = ", expected two numbers from 0 to 1000000, one from -1000 to 1000, and the health's";
  for (const Json& cell : {Json{1, 2}, Json{-1, 2, 3}, Json{1'000'001, 2, 3}, Json{1, -1, 3}, Json{1, 1'000'001, 3},
                           Json{1, 2, -1'001}, Json{1, 2, 1'001}, Json{1, 2, "3"}, Json{1, 2, 3, 4}}) {
    CHECK(problem("/modules/63/cells/1", cell) == "soc/modules/63/cells/1 is " + cell.dump() + triple);
  }
  const char* const health = ", expected the health's four numbers from 0 to 100000000";
  for (const Json& cell : {Json{1, 2, 3, -1, 0, 0, 0}, Json{1, 2, 3, 0, 100'000'001, 0, 0}, Json{1, 2, 3, 0, 0, 0.5, 0},
                           Json{1, 2, 3, 0, 0, 0, "1"}}) {
    CHECK(problem("/modules/63/cells/1", cell) == "soc/modules/63/cells/1 is " + cell.dump() + health);
  }
  const auto unknown_health = read_with("/modules/63/cells/0", Json{1, 2, 3});
  REQUIRE(unknown_health);
  CHECK(unknown_health->state.soc.modules[63].cells[0] ==
        CellSocRecord{.soc_ppm = 1, .sigma_ppm = 2, .hysteresis_permille = 3});
  const auto unknown_time = read_with("/unix_time_ms", 0);
  REQUIRE(unknown_time);
  CHECK(unknown_time->state.soc.is_kept);
}

TEST_CASE("a file of before totals were kept begins at nothing, and one below that is refused",
          "[integration][state]") {
  const PersistentState state = full_state();
  PersistentState without = state;
  without.totals = {};
  const auto before = parse_state(changed(state, [](Json& file) { file["content"].erase("totals"); }));
  REQUIRE(before);
  CHECK(before->state == without);
  for (const char* key : {"charge_out_uAs", "charge_in_uAs", "energy_out_mWh", "energy_in_mWh"}) {
    const auto below = parse_state(changed(state, [key](Json& file) { file["content"]["totals"][key] = -1; }));
    REQUIRE_FALSE(below);
    CHECK(below.error().find("a total is -1") != std::string::npos);
  }
}

TEST_CASE("a file of before something was counted begins at none of it, and a number that is none is refused",
          "[integration][state]") {
  struct Case {
    std::string key;
    std::uint32_t PersistentState::*count;
  };
  for (const Case& one :
       {Case{"starts", &PersistentState::starts}, Case{"hours_since_full", &PersistentState::hours_since_full}}) {
    const std::string& key = one.key;
    const auto count = one.count;
    INFO(key);
    PersistentState state = full_state();
    state.*count = 7;
    PersistentState without = state;
    without.*count = 0;
    const auto before = parse_state(changed(state, [&](Json& file) { file["content"].erase(key); }));
    REQUIRE(before);
    CHECK(before->state == without);
    for (const Json& wrong : {Json(-1), Json(4'294'967'296), Json("3"), Json(1.5), Json(nullptr)}) {
      const auto read = parse_state(changed(state, [&](Json& file) { file["content"][key] = wrong; }));
      INFO(wrong.dump());
      REQUIRE_FALSE(read);
      CHECK(read.error().find(key + " is " + wrong.dump()) != std::string::npos);
    }
  }
}

TEST_CASE("a precharge resistor whose heat no resistor can have is refused", "[integration][state]") {
  constexpr std::int64_t most_uJ = std::int64_t{1} << 60;
  for (const char* key : {"heat_uJ", "last_try_uJ"}) {
    const auto with = [key](std::int64_t heat_uJ) {
      return parse_state(changed({}, [&](Json& file) { file["content"]["closing"]["precharge"][key] = heat_uJ; }));
    };
    CHECK(with(0));
    CHECK(with(most_uJ));
    for (const std::int64_t heat_uJ : {std::int64_t{-1}, most_uJ + 1, INT64_MAX, INT64_MIN}) {
      const auto refused = with(heat_uJ);
      REQUIRE_FALSE(refused);
      CHECK(refused.error().find("a heat is " + std::to_string(heat_uJ)) != std::string::npos);
    }
  }
}

TEST_CASE("a file of the version before, whose frames had less, is read, and the rest is not known",
          "[integration][state]") {
  constexpr std::array later{"mode",
                             "cell_voltage_sum_mV",
                             "module_voltage_sum_mV",
                             "cell_temperature_min_at",
                             "cell_temperature_max_at",
                             "board_temperature_min_dC",
                             "board_temperature_min_at",
                             "board_temperature_max_at",
                             "link_time_constant_ms",
                             "current_2_mA",
                             "discharge_overload_permille",
                             "charge_overload_permille",
                             "outputs",
                             "inputs"};
  const auto read = parse_state(changed(full_state(), [&](Json& file) {
    Json& frame = file["content"]["faults"]["cell_deep_discharge"]["frame"];
    for (const char* key : later) REQUIRE(frame.erase(key) == 1);
  }));
  INFO((read ? "" : read.error()));
  REQUIRE(read);
  PersistentState wanted = full_state();
  FreezeFrame& frame = *wanted.faults[index_of(FaultId::cell_deep_discharge)].frame;
  frame.mode.reset();
  frame.cell_voltage_sum_mV.reset();
  frame.module_voltage_sum_mV.reset();
  frame.cell_temperature_min_at = frame.cell_temperature_max_at = {};
  frame.board_temperature_min_dC.reset();
  frame.board_temperature_min_at = frame.board_temperature_max_at = {};
  frame.link_time_constant_ms.reset();
  frame.current_2_mA.reset();
  frame.discharge_overload_permille.reset();
  frame.charge_overload_permille.reset();
  frame.outputs.reset();
  frame.inputs.reset();
  CHECK(read->state == wanted);
  // A frame with only some of these members is damaged.
  CHECK(problem_of(changed(full_state(), [](Json& file) {
          file["content"]["faults"]["cell_deep_discharge"]["frame"].erase("inputs");
        })) == "inputs is missing");
}

TEST_CASE("a file of before precharge and lock-outs were remembered is read, and none of them is pending",
          "[integration][state]") {
  const auto read = parse_state(changed(full_state(), [](Json& file) { file["content"].erase("closing"); }));
  REQUIRE(read);
  CHECK(read->unknown_names == 0);
  PersistentState expected = full_state();
  expected.closing = {};
  CHECK(read->state == expected);
}

TEST_CASE("a state whose content makes no sense is refused, and the problem is named", "[integration][state]") {
  const auto problem = [](const std::string& pointer, const Json& value) {
    return problem_of(changed(full_state(), [&](Json& file) {
      file[Json::json_pointer("/content/faults/cell_deep_discharge" + pointer)] = value;
    }));
  };
  CHECK(problem("/count", -1) == "count is -1");
  CHECK(problem("/count", 4'294'967'296) == "count is 4294967296");
  CHECK(problem("/count", 1.5) == "count is 1.5");
  CHECK(problem("/count", "1") == "count is \"1\"");
  CHECK(problem("/last_unix_time_ms", 18'446'744'073'709'551'615U).starts_with("last_unix_time_ms is "));
  CHECK(problem("/is_locked", 1) == "is_locked is 1");
  CHECK(problem("/cleared/authority", "god") == "authority is \"god\"");
  CHECK(problem("/frame/phase", "?") == "phase is \"?\"");
  CHECK(problem("/frame/current_mA", 3'000'000'000) == "current_mA is 3000000000");
  CHECK(problem("/frame", 5) == "expected an object, found 5");
  CHECK(problem("", Json::object()) == "count is missing");
  CHECK(problem_of(changed({}, [](Json& file) { file["content"].erase("contactors"); })) == "contactors is missing");
  CHECK(problem_of(changed({}, [](Json& file) { file["content"] = 3; })) == "content is no object");
  CHECK(problem_of(changed({}, [](Json& file) { file["content"]["closing"].erase("lockout_ms"); })) ==
        "lockout_ms is missing");
  CHECK(problem_of(changed({}, [](Json& file) { file["content"]["closing"]["precharge"]["tries_failed"] = 256; })) ==
        "tries_failed is 256");
  CHECK(problem_of(changed({}, [](Json& file) { file["format"] = 2; })) == "found format 2, expected 1");
  CHECK_FALSE(problem_of("").empty());
  CHECK(problem_of("[]") == "expected format, checksum and content");
  CHECK(problem_of(std::string(100'000, '[')) == "nested more than 8 deep");
}

// --- the file -------------------------------------------------------------------------------------------------------

TEST_CASE("without a file it is a first start, then the newest text is read", "[integration][state]") {
  const TemporaryFolder folder;
  StateFile file(folder / "state");
  CHECK(read(file).found == FileFound::nothing);
  REQUIRE(file.write("good 1"));
  CHECK(read(folder / "state").text == "good 1");
  REQUIRE(file.write("good 2"));
  const Found found = read(folder / "state");
  CHECK(found.found == FileFound::newest);
  CHECK(found.text == "good 2");
  CHECK(found.problems.empty());
  CHECK(read_file(folder / "state.previous") == "good 1");
  CHECK_FALSE(std::filesystem::exists(folder / "state.new"));
  CHECK((std::filesystem::status(folder / "state").permissions() & std::filesystem::perms::others_all) ==
        std::filesystem::perms::none);
}

TEST_CASE("a power loss at any step of writing leaves the old text or the new one", "[integration][state][F77]") {
  const TemporaryFolder folder;
  const std::string path = folder / "state";
  put_text(path, "good old");
  SECTION("the new text is half written") {
    put_text(path + ".new", "go");
  }
  SECTION("the new text is written, nothing renamed") {
    put_text(path + ".new", "good new");
  }
  SECTION("between the two renames") {
    std::filesystem::rename(path, path + ".previous");
    put_text(path + ".new", "good new");
  }
  CHECK(read(path).text == "good old");
  // The next session continues from there.
  StateFile file(path);
  static_cast<void>(read(file));
  REQUIRE(file.write("good next"));
  CHECK(read(path).text == "good next");
  CHECK(read_file(path + ".previous") == "good old");
}

TEST_CASE("a damaged file is answered with the previous one, and never takes its place", "[integration][state][F76]") {
  const TemporaryFolder folder;
  const std::string path = folder / "state";
  put_text(path, "garbage");
  put_text(path + ".previous", "good old");
  StateFile file(path);
  const Found found = read(file);
  CHECK(found.found == FileFound::previous);
  CHECK(found.text == "good old");
  CHECK(found.problems == path + ": not good");
  REQUIRE(file.write("good new"));
  CHECK(read(path).text == "good new");
  CHECK(read_file(path + ".previous") == "good old");
  CHECK(read_file(path + ".damaged") == "garbage");
}

TEST_CASE("two damaged files are both kept for people, once there is a good one", "[integration][state]") {
  const TemporaryFolder folder;
  const std::string path = folder / "state";
  put_text(path, "garbage");
  put_text(path + ".previous", "rubbish");
  StateFile file(path);
  CHECK(read(file).found == FileFound::unreadable);
  REQUIRE(file.write("good new"));
  REQUIRE(file.write("good newer"));
  CHECK(read(path).text == "good newer");
  CHECK(read_file(path + ".previous") == "good new");
  CHECK(read_file(path + ".damaged") == "garbage");
  CHECK(read_file(path + ".previous.damaged") == "rubbish");
}

TEST_CASE("two damaged files, or one that is no file, are unreadable and no first start", "[integration][state][F76]") {
  const TemporaryFolder folder;
  const std::string path = folder / "state";
  SECTION("both") {
    put_text(path, "garbage");
    put_text(path + ".previous", "rubbish");
    CHECK(read(path).problems == path + ": not good; " + path + ".previous: not good");
  }
  SECTION("only one, and it is empty") {
    put_text(path, "");
  }
  SECTION("only the previous one") {
    put_text(path + ".previous", "rubbish");
  }
  SECTION("a folder") {
    std::filesystem::create_directory(path);
  }
  SECTION("a pipe") {
    REQUIRE(::mkfifo(path.c_str(), 0600) == 0);
  }
  SECTION("too large") {
    put_text(path, "good" + std::string(StateFile::size_max, ' '));
  }
  CHECK(read(path).found == FileFound::unreadable);
}

TEST_CASE("a full disk costs the new text, never the old one", "[integration][state][F75]") {
  const TemporaryFolder folder;
  const std::string path = folder / "state";
  StateFile file(path);
  REQUIRE(file.write("good old"));
  const std::string large = "good " + std::string(1'000, 'x');
  {
    const FullDisk disk(100);
    const auto written = file.write(large);
    REQUIRE_FALSE(written);
    CHECK(written.error().code == EFBIG);
    CHECK(written.error().what == "write " + path + ".new");
  }
  CHECK(read(path).text == "good old");
  CHECK_FALSE(std::filesystem::exists(path + ".new"));
  REQUIRE(file.write(large));
  CHECK(read(path).text == large);
}

// --- the store ------------------------------------------------------------------------------------------------------

TEST_CASE("what was offered is read by the next life", "[integration][state]") {
  const TemporaryFolder folder;
  const StateStoreOptions options{.path = folder / "state.json"};
  {
    const auto store = open_store(options);
    CHECK(store->found().found == FileFound::nothing);
    CHECK_FALSE(store->found().state);
    store->start();
    for (std::uint32_t count = 1; count <= 100; ++count) {
      PersistentState state = full_state();
      state.contactors[1].closings = count;
      while (!store->offer(state)) {
      }
    }
    REQUIRE(store->flush(test::hang_max));
    CHECK(store->writes() >= 1);
    CHECK(store->writes() <= 100);
    CHECK(store->last_error().empty());
  }
  const auto store = open_store(options);
  CHECK(store->found().found == FileFound::newest);
  REQUIRE(store->found().state);
  CHECK(store->found().state->contactors[1].closings == 100);  // the latest
  CHECK(store->found().state->faults == full_state().faults);
}

TEST_CASE("a store that cannot write says so and tries again until it can", "[integration][state][F75]") {
  const TemporaryFolder folder;
  const auto store = open_store({.path = folder / "state.json", .retry = 1ms});
  store->start();
  {
    const FullDisk disk(100);
    while (!store->offer(full_state())) {
    }
    const auto give_up_at = std::chrono::steady_clock::now() + test::hang_max;
    while (!store->health().store_write_failed && std::chrono::steady_clock::now() < give_up_at) {
      std::this_thread::sleep_for(1ms);
    }
    CHECK(store->health().store_write_failed);
    CHECK_FALSE(store->flush(1ms));
    CHECK(store->writes() == 0);
  }
  REQUIRE(store->flush(test::hang_max));
  CHECK_FALSE(store->health().store_write_failed);
  CHECK(store->writes() == 1);
  CHECK(store->last_error().empty());
  CHECK(parse_state(read_file(folder / "state.json")));
}

TEST_CASE("an unreadable state is told as such, with what is wrong with it", "[integration][state]") {
  const TemporaryFolder folder;
  put_text(folder / "state.json", "not a state");
  const auto store = open_store({.path = folder / "state.json"});
  CHECK(store->found().found == FileFound::unreadable);
  CHECK_FALSE(store->found().state);
  CHECK(store->found().problems.starts_with((folder / "state.json") + ": "));
}

TEST_CASE("too little room on the disk and too much memory are told", "[integration][state]") {
  const TemporaryFolder folder;
  const auto health = [&](const ResourceLimits& limits) {
    const auto store = open_store({.path = folder / "state.json", .limits = limits});
    store->start();
    while (!store->offer({})) {
    }
    REQUIRE(store->flush(test::hang_max));  // its check came before the write
    return store->health();
  };
  constexpr std::uint64_t much = 1'000'000'000'000'000;
  const OwnHealth good = health({.disk_free_min_bytes = 0, .disk_free_min_permille = 0, .memory_max_bytes = much});
  CHECK_FALSE(good.disk_low);
  CHECK_FALSE(good.memory_low);
  CHECK(health({.disk_free_min_bytes = much}).disk_low);
  CHECK(health({.memory_max_bytes = 1'000}).memory_low);
}

TEST_CASE("either of two limits makes a disk low", "[integration][state]") {
  constexpr ResourceLimits limits{.disk_free_min_bytes = 50'000'000, .disk_free_min_permille = 20};
  CHECK_FALSE(is_low({.free_bytes = 50'000'000, .total_bytes = 1'000'000'000}, limits));
  CHECK(is_low({.free_bytes = 49'999'999, .total_bytes = 1'000'000'000}, limits));
  CHECK_FALSE(is_low({.free_bytes = 2'000'000'000, .total_bytes = 100'000'000'000}, limits));
  CHECK(is_low({.free_bytes = 1'999'999'999, .total_bytes = 100'000'000'000}, limits));
  CHECK_FALSE(is_low({.free_bytes = 0, .total_bytes = 0}, limits));
}

TEST_CASE("without a file nothing is kept, and only the memory is watched", "[integration][state]") {
  const auto store = open_store({.limits = {.disk_free_min_bytes = UINT64_MAX}});
  store->start();
  CHECK(store->offer(full_state()));
  CHECK(store->flush(test::hang_max));
  CHECK_FALSE(store->health().disk_low);
  CHECK(store->writes() == 0);
}

TEST_CASE("a folder that is not there is an error at start, and is named", "[integration][state]") {
  const TemporaryFolder folder;
  const auto missing = StateStore::open({.path = folder / "slip/state.json"});
  REQUIRE_FALSE(missing);
  CHECK(missing.error().code == ENOENT);
  CHECK(missing.error().what.find("directory " + (folder / "slip") + " does not exist") != std::string::npos);
  put_text(folder / "file", "");
  const auto no_folder = StateStore::open({.path = folder / "file/state.json"});
  REQUIRE_FALSE(no_folder);
  CHECK(no_folder.error().code == ENOTDIR);
}

TEST_CASE("names of users are those of the file, and who is not in it has a number", "[integration][state]") {
  const TemporaryFolder folder;
  put_text(folder / "passwd",
           "root:x:0:0:root:/root:/bin/sh\n# comment\nanna:x:1000:1000::/home/anna:/bin/sh\nalias:x:1000:1000:::\n"
           ":x:5:5:::\nbroken:x\nodd:x:12a:1:::\nlast:x:7");
  const UserNames users(folder / "passwd");
  CHECK(users.name_of(0) == "root");
  CHECK(users.text_of(1000) == "anna (user 1000)");
  CHECK(users.text_of(5) == "user 5");
  CHECK(users.name_of(12).empty());
  CHECK(users.name_of(7).empty());
  CHECK(UserNames(folder / "none").name_of(0).empty());
}

}  // namespace bmu
