// One object for each cell of the pack, together with the model that all of them refer to. A copy is complete: its
// cells refer to its own model. A cell has `void move_to(const Model&)`: rebinds it to the same model at a new address.
#pragma once

#include <array>
#include <cstddef>

#include "daemon/core/types/core_config.hpp"
#include "protocol/fields.hpp"

namespace bmu {

template <class Model, class Cell>
class CellsOfModel {
 public:
  CellsOfModel() = default;
  CellsOfModel(const CellsOfModel& other) : model_(other.model_), cells_(other.cells_) { move_cells(); }
  CellsOfModel& operator=(const CellsOfModel& other) {
    model_ = other.model_;
    cells_ = other.cells_;
    move_cells();
    return *this;
  }
  ~CellsOfModel() = default;

  /// The state of every cell is unknown afterwards.
  void init(const Model& model) {
    model_ = model;
    cells_ = {};
  }
  [[nodiscard]] const Model& model() const { return model_; }
  /// By number through the pack, from 0.
  [[nodiscard]] Cell& operator[](std::size_t number) { return cells_[number]; }
  [[nodiscard]] const Cell& operator[](std::size_t number) const { return cells_[number]; }

 private:
  void move_cells() {
    for (Cell& cell : cells_) cell.move_to(model_);
  }

  Model model_{};
  std::array<Cell, cells_max> cells_{};
  void after_reading_fields() { move_cells(); }
  BMU_FIELDS(skipped(model_), cells_)
};

}  // namespace bmu
