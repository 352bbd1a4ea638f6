// Reference of one cell's estimator to its model, and whether the estimator has started. It does not own the model: a
// copy or restoration of many estimators together with their model (cells_of_model.hpp) rebinds it to the new address.
// An image (protocol/image.hpp) contains only whether it is set.
#pragma once

#include "protocol/fields.hpp"

namespace bmu {

template <class Model>
class ModelPointer {
 public:
  void set(const Model& model) {
    model_ = &model;
    is_set_ = true;
  }
  /// Rebinds to the same model at its new address. Before set(): no effect.
  void move_to(const Model& model) {
    if (is_set_) model_ = &model;
  }
  [[nodiscard]] bool is_set() const { return is_set_; }
  /// Precondition: set() was called.
  [[nodiscard]] const Model& operator*() const { return *model_; }
  [[nodiscard]] const Model* operator->() const { return model_; }

 private:
  const Model* model_ = nullptr;
  bool is_set_ = false;
  BMU_FIELDS(skipped(model_), is_set_)
};

}  // namespace bmu
