// The estimates of all cells together with the tables they live by. A copy is whole: its cells look at its own tables.
#pragma once

#include <array>
#include <cstddef>

#include "daemon/core/core_config.hpp"
#include "daemon/core/estimators/cell_estimate.hpp"

namespace bmu {

class EstimatedCells {
 public:
  EstimatedCells() = default;
  EstimatedCells(const EstimatedCells& other) : model_(other.model_), cells_(other.cells_) { move_cells(); }
  EstimatedCells& operator=(const EstimatedCells& other) {
    model_ = other.model_;
    cells_ = other.cells_;
    move_cells();
    return *this;
  }
  ~EstimatedCells() = default;

  /// Nothing is known of any cell afterwards.
  void init(const CellDynamics& model) {
    model_ = model;
    cells_ = {};
  }
  [[nodiscard]] const CellDynamics& model() const { return model_; }
  /// By number through the pack, from 0.
  [[nodiscard]] CellEstimate& operator[](std::size_t number) { return cells_[number]; }
  [[nodiscard]] const CellEstimate& operator[](std::size_t number) const { return cells_[number]; }

 private:
  void move_cells() {
    for (CellEstimate& cell : cells_) cell.move_to(model_);
  }

  CellDynamics model_;
  std::array<CellEstimate, cells_max> cells_{};
};

}  // namespace bmu
