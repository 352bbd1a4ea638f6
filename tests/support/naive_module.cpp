#include "tests/support/naive_module.hpp"

namespace bmu::naive {

namespace {

constexpr unsigned uv_default_raw = 30000;
constexpr unsigned ov_default_raw = 42000;
constexpr unsigned checks_to_fail = 30;
constexpr unsigned long minute_ms = 60000;

unsigned char crc_table[256];
bool has_crc_table = false;

void make_crc_table() {
  for (unsigned value = 0; value < 256; value++) {
    unsigned crc = value;
    for (int bit = 0; bit < 8; bit++) {
      crc = (crc & 0x80) ? ((crc << 1) ^ 0x2F) & 0xFF : (crc << 1) & 0xFF;
    }
    crc_table[value] = static_cast<unsigned char>(crc);
  }
  has_crc_table = true;
}

unsigned crc_of(const Frame& f) {
  if (!has_crc_table) make_crc_table();
  unsigned crc = 0xFF;
  crc = crc_table[crc ^ (f.id >> 8)];
  crc = crc_table[crc ^ (f.id & 0xFF)];
  for (int i = 0; i < 7; i++) crc = crc_table[crc ^ f.b[i]];
  return crc ^ 0xFF;
}

void put16(unsigned char* at, unsigned value) {
  at[0] = static_cast<unsigned char>((value >> 8) & 0xFF);
  at[1] = static_cast<unsigned char>(value & 0xFF);
}

void put24(unsigned char* at, unsigned value) {
  at[0] = static_cast<unsigned char>((value >> 16) & 0xFF);
  put16(at + 1, value);
}

void queue(Module& m, unsigned base, const Frame& content, unsigned counter) {
  if (m.out_count == 16) return;
  Frame f = content;
  f.id = base + m.node;
  naive_seal(f, counter);
  m.out[m.out_count++] = f;
}

void queue_status(Module& m, unsigned counter, unsigned long now_ms) {
  bool hot = false;
  bool sensor_fault = false;
  for (int i = 0; i < 4; i++) {
    if (m.board_C[i] > m.board_limit_C && m.board_C[i] != 0x7F) hot = true;
    if (m.board_C[i] == 0x7F) sensor_fault = true;
    if (m.cell_dC[i] == -32767 || m.cell_dC[i] == 32767) sensor_fault = true;
  }
  Frame f;
  f.b[0] = static_cast<unsigned char>((m.has_average ? 1U << 6 : 0U) | (naive_switches(m) ? 0x10U : 0U) | m.cells);
  if (m.open_wires) f.b[1] |= 0x04;
  if (hot) f.b[1] |= 0x08;
  if (m.restarted) f.b[1] |= 0x20;
  if (sensor_fault) f.b[1] |= 0x40;
  if (!m.limits_set) f.b[1] |= 0x80;
  put24(f.b + 2, (m.uv_failed << 12) | m.ov_failed);
  f.b[5] = m.has_average ? static_cast<unsigned char>(now_ms - m.sampled_ms) : 0xFF;
  m.restarted = false;
  queue(m, 0x100, f, counter);
}

void queue_cells(Module& m, unsigned counter, bool is_sync) {
  static const unsigned bases[4] = {0x140, 0x180, 0x1C0, 0x200};
  const unsigned newest = (m.ring_at + 9) % 10;
  for (unsigned frame = 0; frame * 3 < m.cells; frame++) {
    Frame f;
    for (unsigned slot = 0; slot < 3; slot++) {
      const unsigned cell = frame * 3 + slot;
      unsigned value = 0xFFFF;
      if (cell < m.cells && m.has_average) value = is_sync ? m.ring[cell][newest] : m.average[cell];
      const unsigned wires = (m.open_wires << 1) | m.open_wires;  // the cells on both sides of an open wire
      if (cell < m.cells && ((wires >> cell) & 1)) value = 0xFFFF;
      put16(&f.b[2UL * slot], value);
    }
    queue(m, bases[frame], f, counter);
  }
}

void queue_temperatures(Module& m, unsigned counter) {
  Frame first;
  Frame second;
  for (unsigned i = 0; i < 4; i++) {
    const unsigned value = i < m.sensors ? static_cast<unsigned>(m.cell_dC[i]) & 0xFFFF : 0x8000;
    put16(i < 3 ? &first.b[2UL * i] : second.b, value);
    second.b[2 + i] = static_cast<unsigned char>(static_cast<unsigned>(m.board_C[i]) & 0xFF);
  }
  queue(m, 0x240, first, counter);
  queue(m, 0x280, second, counter);
}

void queue_module(Module& m, unsigned counter, unsigned long now_ms) {
  unsigned long longest = 0;
  for (unsigned i = 0; i < 12; i++) {
    if (m.balance_until_ms[i] > now_ms && m.balance_until_ms[i] - now_ms > longest) {
      longest = m.balance_until_ms[i] - now_ms;
    }
  }
  Frame f;
  put16(f.b, m.module_raw);
  put24(f.b + 2, (naive_switches(m) << 12) | m.open_wires);
  f.b[5] = static_cast<unsigned char>((longest + minute_ms - 1) / minute_ms);
  queue(m, 0x2C0, f, counter);
}

void queue_ident(Module& m, unsigned counter) {
  Frame f;
  f.b[0] = 1;
  f.b[1] = static_cast<unsigned char>((m.cells << 4) | m.sensors);
  put16(f.b + 2, m.serial >> 16);
  put16(f.b + 4, m.serial);
  queue(m, 0x300, f, counter);
}

void stop_balancing(Module& m) {
  for (int i = 0; i < 12; i++) {
    m.minutes[i] = 0;
    m.balance_until_ms[i] = 0;
  }
}

void take_poll(Module& m, const Frame& f, unsigned long now_ms) {
  if (m.has_poll_counter && f.b[6] == m.poll_counter) return;  // stale
  m.has_poll_counter = true;
  m.poll_counter = f.b[6];
  m.polled_ms = now_ms;
  if (f.b[0] != 0 && f.b[0] != m.node) return;
  m.out_count = 0;  // a new POLL ends a pending answer
  if (f.b[1] & 0x01) queue_status(m, f.b[6], now_ms);
  if (f.b[1] & 0x02) queue_cells(m, f.b[6], (f.b[1] & 0x80) != 0);
  if (f.b[1] & 0x04) queue_temperatures(m, f.b[6]);
  if (f.b[1] & 0x08) queue_module(m, f.b[6], now_ms);
  if (f.b[1] & 0x10) queue_ident(m, f.b[6]);
  m.polls_answered++;
}

unsigned balance(Module& m, const Frame& f, unsigned long now_ms) {
  unsigned long long bits = 0;
  for (int i = 1; i <= 5; i++) bits = (bits << 8) | f.b[i];
  unsigned wanted[12];
  for (int i = 0; i < 12; i++) {
    wanted[i] = static_cast<unsigned>(bits >> (37 - 3 * i)) & 7;
    if (wanted[i] == 6) return 2;
    if (wanted[i] != 7 && wanted[i] != 0 && i >= static_cast<int>(m.cells)) return 2;
  }
  for (int i = 0; i < 12; i++) {
    if (wanted[i] == 7 || wanted[i] == m.minutes[i]) continue;  // starts when the commanded value changes
    m.minutes[i] = wanted[i];
    m.balance_until_ms[i] = wanted[i] ? now_ms + wanted[i] * minute_ms : 0;
  }
  return 0;
}

unsigned obey(Module& m, const Frame& f, bool is_to_all, unsigned long now_ms) {
  if (f.b[0] == 1) {
    if (f.b[1] == 3) {
      m.asleep = true;
      stop_balancing(m);
      return 0;
    }
    return f.b[1] == 1 ? 0 : 2;
  }
  if (f.b[0] == 2) {
    const unsigned uv = f.b[1] * 256U + f.b[2];
    const unsigned ov = f.b[3] * 256U + f.b[4];
    if (uv >= ov) return 2;
    m.uv_raw = uv;
    m.ov_raw = ov;
    m.limits_set = true;
    return 0;
  }
  if (f.b[0] == 3) return balance(m, f, now_ms);
  if (f.b[0] == 4) {
    stop_balancing(m);
    return 0;
  }
  if (f.b[0] == 5) {
    for (int i = 0; i < 12; i++) m.uv_count[i] = m.ov_count[i] = 0;
    m.uv_failed = m.ov_failed = 0;
    return 0;
  }
  if (f.b[0] == 6) {
    const unsigned serial = f.b[2] * 0x1000000U + f.b[3] * 0x10000U + f.b[4] * 0x100U + f.b[5];
    if (!is_to_all || f.b[1] < 1 || f.b[1] > 63) return 2;
    if (serial == m.serial) m.node = f.b[1];
    return 0;
  }
  if (f.b[0] == 7) {
    m.board_limit_C = f.b[1];
    return 0;
  }
  return 1;
}

void take_command(Module& m, const Frame& f, unsigned long now_ms) {
  const bool is_to_all = f.id == 0x340;
  const int identifier = is_to_all ? 1 : 0;
  if (m.has_command_counter[identifier] && f.b[6] == m.command_counter[identifier]) return;
  m.has_command_counter[identifier] = true;
  m.command_counter[identifier] = f.b[6];
  Frame answer;
  answer.b[0] = f.b[0];
  answer.b[1] = static_cast<unsigned char>(obey(m, f, is_to_all, now_ms));
  if (!is_to_all) queue(m, 0x380, answer, f.b[6]);
}

void measure(Module& m, unsigned long now_ms) {
  m.sampled_ms = now_ms;
  for (unsigned i = 0; i < m.cells; i++) m.ring[i][m.ring_at] = m.cell_raw[i];
  m.ring_at = (m.ring_at + 1) % 10;
  if (m.ring_at != 0) return;
  m.has_average = true;
  for (unsigned i = 0; i < m.cells; i++) {
    unsigned sum = 0;
    for (int k = 0; k < 10; k++) sum += m.ring[i][k];
    m.average[i] = (sum + 5) / 10;
    m.uv_count[i] = m.average[i] < m.uv_raw ? m.uv_count[i] + 1 : 0;
    m.ov_count[i] = m.average[i] > m.ov_raw ? m.ov_count[i] + 1 : 0;
    if (m.uv_count[i] > checks_to_fail) m.uv_failed |= 1U << i;
    if (m.ov_count[i] > checks_to_fail) m.ov_failed |= 1U << i;
    if (((m.uv_failed | m.ov_failed) >> i) & 1) m.balance_until_ms[i] = 0;
  }
}

}  // namespace

void naive_seal(Frame& f, unsigned counter) {
  f.length = 8;
  f.b[6] = static_cast<unsigned char>(counter & 0xFF);
  f.b[7] = static_cast<unsigned char>(crc_of(f));
}

void naive_init(Module& m, unsigned node, unsigned cells, unsigned sensors, unsigned serial, unsigned long now_ms) {
  m = Module{};
  m.node = node;
  m.cells = cells;
  m.sensors = sensors;
  m.serial = serial;
  m.uv_raw = uv_default_raw;
  m.ov_raw = ov_default_raw;
  m.board_limit_C = 85;
  m.restarted = true;
  m.sampled_ms = now_ms;
  m.polled_ms = now_ms;
  m.ident_due = true;
  m.ident_ms = now_ms + 10UL * node;
}

void naive_receive(Module& m, const Frame& f, unsigned long now_ms) {
  if (m.asleep) {  // any traffic wakes it; the frame itself is lost
    m.asleep = false;
    m.woken = true;
    m.woken_ms = now_ms;
    m.polled_ms = now_ms;
    m.ident_due = true;
    m.ident_ms = now_ms + 10UL * m.node;
    return;
  }
  const bool is_poll = f.id == 0x080;
  const bool is_command = f.id == 0x340 || f.id == 0x340 + m.node;
  if (!is_poll && !is_command) return;
  if (f.length != 8 || crc_of(f) != f.b[7]) return;
  if (m.woken && now_ms - m.woken_ms < 50) return;
  m.woken = false;
  if (is_poll) take_poll(m, f, now_ms);
  if (is_command) take_command(m, f, now_ms);
}

void naive_tick(Module& m, unsigned long now_ms) {
  if (m.asleep) return;
  if (now_ms - m.sampled_ms >= 10) measure(m, now_ms);
  if (now_ms - m.polled_ms >= 1000) stop_balancing(m);
  for (unsigned i = 0; i < 12; i++) {
    if (m.balance_until_ms[i] <= now_ms) m.balance_until_ms[i] = 0;
  }
  if (m.ident_due && now_ms >= m.ident_ms) {
    m.ident_due = false;
    queue_ident(m, 0);
  }
}

bool naive_send(Module& m, Frame& f) {
  if (m.out_count == 0) return false;
  f = m.out[0];
  m.out_count--;
  for (unsigned i = 0; i < m.out_count; i++) m.out[i] = m.out[i + 1];
  return true;
}

unsigned naive_switches(const Module& m) {
  unsigned mask = 0;
  for (unsigned i = 0; i < m.cells; i++) {
    bool is_hot = false;
    for (int k = 0; k < 4; k++) is_hot = is_hot || m.board_C[k] > m.board_limit_C;
    if (m.balance_until_ms[i] != 0 && !is_hot) mask |= 1U << i;
  }
  return mask;
}

}  // namespace bmu::naive
