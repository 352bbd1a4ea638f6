// Where the model lies that an estimator of one cell looks at, and whether it has begun with one at all. The model is
// not its own: whoever copies or restores many estimators together with their model (cells_of_model.hpp) says where it
// lies now. Of an image (protocol/image.hpp) only whether there is one.
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
  /// The same model, where it lies now. Before set(): nothing.
  void move_to(const Model& model) {
    if (is_set_) model_ = &model;
  }
  [[nodiscard]] bool is_set() const { return is_set_; }
  /// After set().
  [[nodiscard]] const Model& operator*() const { return *model_; }
  [[nodiscard]] const Model* operator->() const { return model_; }

 private:
  const Model* model_ = nullptr;
  bool is_set_ = false;
  BMU_FIELDS(skipped(model_), is_set_)
};

}  // namespace bmu
