// Selection and width of the columns of the --follow table in a window. The values are the main content: they get half
// of the width, and enough for three numbers. Other columns are removed, the least informative first: the count, the
// longest gap, the age (an old row is also grey), the rate.
#pragma once

namespace bmu::dump {

/// Widths of the longest texts.
struct ColumnNeeds {
  int bus = 0;  // 0: there is one bus, which needs no column
  int id = 3;
  int name = 7;
};

/// Widths, with the space between columns; 0: the column is omitted. In the order of the columns.
struct FollowColumns {
  int bus = 0;
  int id = 0;
  int name = 0;
  int frames = 0;
  int rate = 0;
  int gap = 0;
  int age = 0;
  int values_space = 0;
  int values = 0;  // the remaining width
};

[[nodiscard]] FollowColumns fit_columns(const ColumnNeeds& needs, int width);

}  // namespace bmu::dump
