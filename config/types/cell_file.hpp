// A cell as its file describes it.
#pragma once

#include <optional>
#include <string>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "daemon/core/cell/cell_model.hpp"
#include "daemon/core/cell/charge_plateau_model.hpp"
#include "daemon/core/cell/derating.hpp"

namespace bmu {

/// A cell file: the model, and what is only for people.
struct CellFile {
  std::string name;
  std::string origin;
  CellModel model;
  std::optional<CellDynamics> dynamics;  // measured tables; without them the few numbers of `model` stand for the cell
  DeratingTables derating;               // those that are given
  std::optional<ChargePlateauModel> charge_plateau{};  // what a whole charge says of the capacity
};

}  // namespace bmu
