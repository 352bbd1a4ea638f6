// Readers of the rows of the fault table: each function derives from the inputs the one number that its row compares.
//
// An unknown reading neither raises nor clears. "Not yet received" is not "lost": readers of receive timeouts return
// unknown until all data has been received once or the start grace is over.
#pragma once

#include "daemon/core/faults/fault_table.hpp"

namespace bmu::fault_readers {

// cells and temperatures
Reading cell_voltage_min_uV(const FaultInputs& in);
Reading cell_voltage_max_uV(const FaultInputs& in);
Reading cell_voltage_spread_uV(const FaultInputs& in);
Reading cell_resistance_permille(const FaultInputs& in);
Reading pack_resistance_permille(const FaultInputs& in);
Reading cell_temperature_max_dC(const FaultInputs& in);
Reading cell_temperature_min_dC(const FaultInputs& in);
Reading board_temperature_max_dC(const FaultInputs& in);
Reading board_temperature_min_dC(const FaultInputs& in);
Reading temperature_rise_mK_per_s(const FaultInputs& in);
Reading temperature_spread_dC(const FaultInputs& in);

// current
Reading discharge_current_mA(const FaultInputs& in);
Reading charge_current_mA(const FaultInputs& in);
Reading discharge_overload_permille(const FaultInputs& in);
Reading charge_overload_permille(const FaultInputs& in);
Reading discharge_not_allowed(const FaultInputs& in);
Reading charge_not_allowed(const FaultInputs& in);
Reading current_while_open(const FaultInputs& in);

// plausibility between measurements
Reading pack_voltage_mismatch_mV(const FaultInputs& in);
Reading module_voltage_mismatch_mV(const FaultInputs& in);
Reading stuck_values_ms(const FaultInputs& in);
Reading current_contradicts_voltage(const FaultInputs& in);
Reading current_sensors_apart_mA(const FaultInputs& in);
Reading soc_methods_disagree(const FaultInputs& in);
Reading cell_model_mismatch(const FaultInputs& in);

// modules
Reading module_lost(const FaultInputs& in);
Reading cell_not_measured(const FaultInputs& in);
Reading temperature_not_measured(const FaultInputs& in);
Reading open_wire(const FaultInputs& in);
Reading module_disturbed(const FaultInputs& in);
Reading module_reports_fault(const FaultInputs& in);
Reading module_reports_undervoltage(const FaultInputs& in);
Reading module_warning(const FaultInputs& in);
Reading module_starting(const FaultInputs& in);
Reading module_going_to_sleep(const FaultInputs& in);
Reading module_alone(const FaultInputs& in);
Reading balancing_stays_on(const FaultInputs& in);
Reading balancing_stays_off(const FaultInputs& in);
Reading balancing_refused(const FaultInputs& in);
Reading module_mismatch(const FaultInputs& in);
Reading wrong_cell_count(const FaultInputs& in);
Reading module_exchanged(const FaultInputs& in);
Reading modules_swapped(const FaultInputs& in);
Reading module_not_set_up(const FaultInputs& in);
Reading duplicate_node(const FaultInputs& in);
Reading unknown_module(const FaultInputs& in);

// sensor, power distribution unit, inputs, insulation
Reading current_sensor_lost(const FaultInputs& in);
Reading voltage_sensor_lost(const FaultInputs& in);
Reading sensor_not_set_up(const FaultInputs& in);
Reading pdu_lost(const FaultInputs& in);
Reading pdu_opened_by_itself(const FaultInputs& in);
Reading emergency_stop(const FaultInputs& in);
Reading interlock_open(const FaultInputs& in);
Reading supply_low(const FaultInputs& in);
Reading lines_failed(const FaultInputs& in);
Reading insulation_not_ok(const FaultInputs& in);
Reading insulation_Ohm(const FaultInputs& in);
Reading insulation_driving_Ohm(const FaultInputs& in);
Reading insulation_monitor_lost(const FaultInputs& in);
Reading insulation_monitor_untested(const FaultInputs& in);

// contactors
Reading precharge_too_slow(const FaultInputs& in);
Reading precharge_too_fast(const FaultInputs& in);
Reading precharge_overcurrent(const FaultInputs& in);
Reading contactor_not_following(const FaultInputs& in);
Reading contactor_welded(const FaultInputs& in);
Reading link_not_following(const FaultInputs& in);
Reading link_not_discharging(const FaultInputs& in);

// buses and the daemon itself
Reading charger_silent(const FaultInputs& in);
Reading charger_runaway(const FaultInputs& in);
Reading charger_keeps_on(const FaultInputs& in);
Reading charger_trouble(const FaultInputs& in);
Reading charger_contradicts(const FaultInputs& in);
Reading foreign_charger_master(const FaultInputs& in);
Reading foreign_charger_commands(const FaultInputs& in);
Reading foreign_master(const FaultInputs& in);
Reading foreign_reporter(const FaultInputs& in);
Reading second_pack_silent(const FaultInputs& in);
Reading inverter_silent(const FaultInputs& in);
Reading inverter_lost(const FaultInputs& in);
Reading inverter_trouble(const FaultInputs& in);
Reading foreign_battery(const FaultInputs& in);
Reading internal_bus_down(const FaultInputs& in);
Reading bus_off_storm(const FaultInputs& in);
Reading bus_error_passive(const FaultInputs& in);
Reading command_not_on_bus(const FaultInputs& in);
Reading frames_lost(const FaultInputs& in);
Reading loop_gap(const FaultInputs& in);
Reading tick_overrun(const FaultInputs& in);
Reading store_unreadable(const FaultInputs& in);
Reading store_write_failed(const FaultInputs& in);
Reading history_write_failed(const FaultInputs& in);
Reading clock_jump(const FaultInputs& in);
Reading memory_low(const FaultInputs& in);
Reading disk_low(const FaultInputs& in);
Reading front_end_supply_low(const FaultInputs& in);
Reading front_end_overtemperature(const FaultInputs& in);
Reading front_end_faults_missing(const FaultInputs& in);
Reading module_supply_lost(const FaultInputs& in);
Reading alarm_loop_open(const FaultInputs& in);

}  // namespace bmu::fault_readers
