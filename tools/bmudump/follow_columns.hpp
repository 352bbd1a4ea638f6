// Which columns the table of --follow has in a window, and how wide they are. The values are what one looks for: they
// get half of it, and enough for three numbers. The others go, the one that says least first: how many, the longest
// gap, how old (an old row is grey, too), how often.
#pragma once

namespace bmu::dump {

/// What the longest texts need.
struct ColumnNeeds {
  int bus = 0;  // 0: there is one bus, which needs no telling
  int id = 3;
  int name = 7;
};

/// Widths, with the space between columns; 0: the column is not there. They stand in this order.
struct FollowColumns {
  int bus = 0;
  int id = 0;
  int name = 0;
  int frames = 0;
  int rate = 0;
  int gap = 0;
  int age = 0;
  int values_space = 0;
  int values = 0;  // what is left
};

[[nodiscard]] FollowColumns fit_columns(const ColumnNeeds& needs, int width);

}  // namespace bmu::dump
