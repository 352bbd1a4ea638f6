// The table of --follow: a row for each identifier on each bus, with how many and how often, the longest gap, how old
// the last frame is, what failed, and the values it last had; in a narrow window fewer of these (follow_columns.hpp).
//
//   vcan0   1240 frames   412/s   load 10.6 % of 500 kbit/s
//   id  message           frames    rate gap max    age  values
//   143 CELLS_1 node 3       120  10.0/s  0.10 s 0.04 s  cell_voltage_1 3.6512 V  _2 3.6498 V  _3 3.6530 V
//
// Times are those of the frames without what the clock of a log was set by; `now_us` on the same clock makes the ages.
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
  /// `formats` by reader. Both stay the caller's.
  Follow(const BusTable& buses, const std::vector<FrameText>& formats, std::uint32_t bit_rate)
      : buses_(&buses), formats_(&formats), bit_rate_(bit_rate), words_(-1) {}

  /// `row` is what the statistics have of the frame's identifier; null: the bus's own counts must do. `left_out_us`:
  /// what the log's clock was set by before this frame.
  void note(const Bus& bus, const SeenFrame& seen, const IdStatistics* row, std::int64_t left_out_us = 0);
  /// The time of the newest frame.
  [[nodiscard]] std::int64_t newest_us() const { return newest_us_; }

  /// Where the window is: its first row, and of each row its first value.
  struct Place {
    std::size_t row = 0;
    std::size_t value = 0;
  };

  /// Draws what fits: a head for each bus, then rows. Rates are those of the last second or so.
  void draw(std::int64_t now_us, const Place& place, Canvas& canvas);
  [[nodiscard]] std::size_t row_count() const { return rows_.size(); }
  /// The last value worth beginning with: from there on those of all rows of the last window fit.
  [[nodiscard]] std::size_t value_max() const { return value_max_; }
  /// Rows a window of this height has room for.
  [[nodiscard]] std::size_t rows_in(int height) const;
  /// The whole table as text, rates over all the time.
  void print_last(bool is_coloured, TextWriter& out);

 private:
  enum class Kind : std::uint8_t { standard, extended, error, other };

  /// How many there were when it was last looked at: the difference is a rate.
  struct Window {
    std::int64_t begin_us = 0;
    double count_at_begin = 0;
    double per_s = 0;
    bool is_whole = false;  // false: no second has passed yet, or next to nothing came in it

    void look(std::int64_t now_us, double count);
  };
  struct Row {
    const Bus* bus = nullptr;
    const IdStatistics* statistics = nullptr;  // null: error frames, remote and FD frames, those beyond the rows
    std::uint64_t frames = 0;
    std::int64_t last_us = 0;
    LogLine line;            // the last that passed, or else the last
    std::string long_frame;  // what `line` has of one
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
  bool is_over_ = false;  // rates are those of all the time
};

}  // namespace bmu::dump
