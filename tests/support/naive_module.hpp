// A module as an independent developer would write it from version 1 of the protocol, without this project: plain
// structs, if-chains, its own checksum table. It shares no line with mmu/ or protocol/ on purpose: its agreement with
// the daemon follows from the protocol alone, and where it differs from mmu/ the protocol leaves it open.
//
// It implements none of the rules that docs/bus-protocol.md adds to the first text: it never sleeps without a command,
// and a cell's minutes keep their number, so that only a different one restarts its time. It does less than mmu/: its
// supply never fails, it never balances autonomously, and its front end is always right.
//
//   naive_init(m, 3, 12, 4, 1234, now_ms)
//   naive_receive(m, frame, now_ms)      a frame from the bus
//   naive_tick(m, now_ms)                every millisecond, after cell_raw and the temperatures were set
//   while (naive_send(m, frame)) ...     its frames to send
#pragma once

namespace bmu::naive {

struct Frame {
  unsigned id = 0;
  unsigned length = 8;
  unsigned char b[8] = {};
};

struct Module {
  // Identity.
  unsigned node;
  unsigned cells;
  unsigned sensors;
  unsigned serial;

  // Inputs; the owner sets them.
  unsigned cell_raw[12];  // as on the wire: 0.1 mV
  int cell_dC[4];
  int board_C[4];
  unsigned open_wires;
  unsigned module_raw;  // 2 mV

  // Received settings.
  unsigned uv_raw;  // 0.1 mV
  unsigned ov_raw;
  int board_limit_C;
  bool limits_set;
  bool has_poll_counter;
  unsigned poll_counter;
  bool has_command_counter[2];  // addressed to it, to all: two identifiers
  unsigned command_counter[2];
  unsigned long polled_ms;
  bool asleep;
  bool woken;  // less than 50 ms ago
  unsigned long woken_ms;

  // Measuring.
  unsigned long sampled_ms;
  unsigned ring[12][10];
  unsigned ring_at;
  unsigned average[12];
  bool has_average;
  unsigned uv_count[12];
  unsigned ov_count[12];
  unsigned uv_failed;  // until the faults are cleared
  unsigned ov_failed;

  // Balancing.
  unsigned minutes[12];
  unsigned long balance_until_ms[12];

  // Sending.
  bool restarted;
  bool ident_due;
  unsigned long ident_ms;
  Frame out[16];
  unsigned out_count;
  unsigned polls_answered;
};

void naive_init(Module& m, unsigned node, unsigned cells, unsigned sensors, unsigned serial, unsigned long now_ms);
void naive_receive(Module& m, const Frame& f, unsigned long now_ms);
void naive_tick(Module& m, unsigned long now_ms);
bool naive_send(Module& m, Frame& f);

/// Bit k is cell k+1, as everywhere here.
unsigned naive_switches(const Module& m);
/// Puts counter and checksum on a frame; for masters as simple as this module.
void naive_seal(Frame& f, unsigned counter);

}  // namespace bmu::naive
