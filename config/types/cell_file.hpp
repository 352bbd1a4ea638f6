// A cell as its file describes it.
#pragma once

#include <optional>
#include <string>

#include "daemon/core/cell/cell_dynamics.hpp"
#include "daemon/core/cell/cell_model.hpp"
#include "daemon/core/cell/charge_plateau_model.hpp"
#include "daemon/core/cell/derating.hpp"

namespace bmu {

/// Content of a cell file: the model, and texts for display only.
struct CellFile {
  std::string name;
  std::string origin;
  CellModel model;
  std::optional<CellDynamics> dynamics;  // measured tables; without them the few numbers of `model` describe the cell
  DeratingTables derating;               // those that are given
  std::optional<ChargePlateauModel> charge_plateau{};  // capacity from a complete charge
};

}  // namespace bmu
