// The table of --follow: a row for each identifier on each bus, with its frame count, rate, longest gap, age of the
// last frame, failures, and latest values; in a narrow window fewer of these (follow_columns.hpp).
//
//   vcan0   1240 frames   412/s   load 10.6 % of 500 kbit/s
//   id  message           frames    rate gap max    age  values
//   143 CELLS_1 node 3       120  10.0/s  0.10 s 0.04 s  cell_voltage_1 3.6512 V  _2 3.6498 V  _3 3.6530 V
//
// Times are those of the frames minus the jumps of the log's clock; ages are relative to `now_us` on the same clock.
// Memory is bounded as that of the statistics.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "tools/bmudump/bus_table.hpp"
#include "tools/bmudump/follow_columns.hpp"
#include "tools/bmudump/frame_text.hpp"
#include "tools/common/canvas.hpp"

namespace bmu::dump {

class Follow {
 public:
  /// `formats` by reader. Both must outlive the object.
  Follow(const BusTable& buses, const std::vector<FrameText>& formats, std::uint32_t bit_rate)
      : buses_(&buses), formats_(&formats), bit_rate_(bit_rate), words_(-1) {}

  /// `row`: statistics of the frame's identifier; null: only the counts of the bus apply. `left_out_us`: sum of the
  /// jumps of the log's clock before this frame.
  void note(const Bus& bus, const SeenFrame& seen, const IdStatistics* row, std::int64_t left_out_us = 0);
  /// The time of the newest frame.
  [[nodiscard]] std::int64_t newest_us() const { return newest_us_; }

  /// Scroll position of the window: its first row, and the first value in each row.
  struct Place {
    std::size_t row = 0;
    std::size_t value = 0;
  };

  /// Draws what fits: a head for each bus, then rows. Rates are those of about the last second.
  void draw(std::int64_t now_us, const Place& place, Canvas& canvas);
  [[nodiscard]] std::size_t row_count() const { return rows_.size(); }
  /// The highest useful first value: with it the values of all rows of the last window fit.
  [[nodiscard]] std::size_t value_max() const { return value_max_; }
  /// Number of rows in a window of this height.
  [[nodiscard]] std::size_t rows_in(int height) const;
  /// The whole table as text, with rates over the whole time.
  void print_last(bool is_coloured, TextWriter& out);

 private:
  enum class Kind : std::uint8_t { standard, extended, error, other };

  /// Count at the start of a window: its increase gives the rate.
  struct Window {
    std::int64_t begin_us = 0;
    double count_at_begin = 0;
    double per_s = 0;
    bool is_whole = false;  // false: less than one second elapsed, or too few frames arrived in it

    void look(std::int64_t now_us, double count);
  };
  struct Row {
    const Bus* bus = nullptr;
    const IdStatistics* statistics = nullptr;  // null: error frames, remote and FD frames, those beyond the rows
    std::uint64_t frames = 0;
    std::int64_t last_us = 0;
    LogLine line;            // the last frame that passed, or else the last one
    std::string long_frame;  // storage for the long frame of `line`
    CheckedFrame verdict;
    Window window;
  };
  struct Head {
    Window frames;
    Window bits;
  };
  using Key = std::tuple<std::size_t, Kind, std::uint32_t>;

  static Key key_of(const Bus& bus, const SeenFrame& seen, const IdStatistics* row);
  [[nodiscard]] FollowColumns columns_for(int width) const;
  void draw_in(const FollowColumns& columns, std::int64_t now_us, const Place& place, Canvas& canvas);
  void draw_heads(std::int64_t now_us, Canvas& canvas);
  [[nodiscard]] std::string head_text(const BusStatistics& all, const Head& head, bool is_short) const;
  static void draw_titles(int line, const FollowColumns& columns, bool is_aside, Canvas& canvas);
  void draw_row(int line, const Key& key, const Row& row, std::int64_t now_us, const FollowColumns& columns,
                std::size_t first_value, Canvas& canvas);
  void draw_values(int line, int column, const Row& row, Style style, std::size_t first_value, Canvas& canvas);
  void draw_foot(std::size_t first_row, std::size_t end_row, Canvas& canvas) const;
  static std::string id_text(const Key& key);
  static std::string row_name(const Key& key, const Row& row);
  [[nodiscard]] std::string values_of(const Row& row);
  [[nodiscard]] int head_rows() const;

  const BusTable* buses_;
  const std::vector<FrameText>* formats_;
  std::uint32_t bit_rate_;
  TextWriter words_;  // never flushed
  std::map<Key, Row> rows_;
  std::vector<Head> heads_;  // by index of the bus
  std::int64_t newest_us_ = 0;
  std::size_t value_max_ = 0;
  bool is_over_ = false;  // rates are over the whole time
};

}  // namespace bmu::dump
