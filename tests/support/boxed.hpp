// A value on the heap that is copied with its holder: for types too large to have many of them on the stack.
#pragma once

#include <memory>
#include <utility>

namespace bmu::test {

template <class Value>
class Boxed {
 public:
  template <class... Arguments>
  explicit Boxed(std::in_place_t, Arguments&&... arguments)
      : value_(std::make_unique<Value>(std::forward<Arguments>(arguments)...)) {}
  Boxed(const Boxed& other) : value_(std::make_unique<Value>(*other.value_)) {}
  Boxed& operator=(const Boxed& other) {
    *value_ = *other.value_;
    return *this;
  }
  ~Boxed() = default;

  [[nodiscard]] Value& operator*() { return *value_; }
  [[nodiscard]] const Value& operator*() const { return *value_; }
  [[nodiscard]] Value* operator->() { return value_.get(); }
  [[nodiscard]] const Value* operator->() const { return value_.get(); }

 private:
  std::unique_ptr<Value> value_;
};

}  // namespace bmu::test
