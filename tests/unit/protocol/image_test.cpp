// State of an object as bytes, and back.
#include "protocol/image.hpp"

#include <limits>
#include <numeric>
#include <vector>

#include "protocol/time.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

enum class Word : std::uint8_t { none, first, seventh = 7 };
enum class SignedWord : std::int8_t { low = 0, high = 3 };

struct Plain {
  std::int32_t number = -2;
  bool is_so = true;
  Word word = Word::seventh;
};

struct Model {
  int value = 5;
};

class Holder {
 public:
  Holder() = default;
  explicit Holder(const Model& model) : model_(&model) {}

  void fill() {
    count_ = 9;
    items_.push_back({.number = 3, .is_so = false, .word = Word::first});
    span_ = 5s;
    either_ = Plain{.number = 8};
    doubles_[0] = -0.25;
    at_ = TimePoint{7ns};
    low_ = SignedWord::high;
  }
  [[nodiscard]] const Model* model() const { return model_; }
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] int times_read() const { return times_read_; }

 private:
  const Model* model_ = nullptr;
  std::size_t count_ = 0;
  FixedVector<Plain, 3> items_;
  std::optional<Duration> span_;
  std::variant<std::int32_t, Plain> either_;
  std::array<std::optional<double>, 3> doubles_{std::nullopt, 1.5, std::numeric_limits<double>::quiet_NaN()};
  TimePoint at_{};
  SignedWord low_ = SignedWord::low;
  int times_read_ = 0;

  void after_reading_fields() { ++times_read_; }
  BMU_FIELDS(skipped(model_), count_, items_, span_, either_, doubles_, at_, low_, skipped(times_read_))
};

class Forgetful {
 public:
  [[nodiscard]] std::int64_t sum() const { return first_ + second_; }

 private:
  std::int64_t first_ = 0;
  std::int64_t second_ = 0;
  BMU_FIELDS(first_)
};

/// Class that checks its own index.
class Ring {
 public:
  [[nodiscard]] int read() const { return items_[next_]; }

 private:
  std::array<int, 3> items_{};
  std::size_t next_ = 0;
  [[nodiscard]] bool are_fields_possible() const { return next_ < items_.size(); }
  BMU_FIELDS(items_, next_)
};

struct Given {
  std::uint8_t number = 0;
  std::int32_t from_configuration = 0;
  BMU_FIELDS(number, skipped(from_configuration))
};

static_assert(image_names_all_fields<Holder>);
static_assert(names_all_fields<Holder>());
static_assert(names_all_fields<Plain>());
static_assert(!names_all_fields<Forgetful>());
static_assert(field_count<Plain> == 3);
static_assert(is_enumerator<Word>(7));
static_assert(!is_enumerator<Word>(6) && !is_enumerator<Word>(255));
static_assert(is_enumerator<SignedWord>(0) && !is_enumerator<SignedWord>(-1));

template <class T>
std::vector<std::uint8_t> image_of(const T& value) {
  std::vector<std::uint8_t> bytes(image_size(value));
  REQUIRE(write_image(value, bytes) == bytes.size());
  return bytes;
}

}  // namespace

TEST_CASE("numbers stand in an image in their order, little end first", "[unit][image]") {
  CHECK(image_of(Plain{.number = 0x01020304}) == std::vector<std::uint8_t>{4, 3, 2, 1, 1, 7});
  CHECK(image_of(Plain{.number = -1, .is_so = false, .word = Word::none}) ==
        std::vector<std::uint8_t>{0xff, 0xff, 0xff, 0xff, 0, 0});
  CHECK(image_of(std::optional<std::uint16_t>{}) == std::vector<std::uint8_t>{0});
  CHECK(image_of(std::optional<std::uint16_t>{0x0102}) == std::vector<std::uint8_t>{1, 2, 1});
  CHECK(image_of(std::size_t{258}) == std::vector<std::uint8_t>{2, 1, 0, 0, 0, 0, 0, 0});
  CHECK(image_of(1.0) == std::vector<std::uint8_t>{0, 0, 0, 0, 0, 0, 0xf0, 0x3f});
  CHECK(image_of(TimePoint{258ns}) == std::vector<std::uint8_t>{2, 1, 0, 0, 0, 0, 0, 0});
}

TEST_CASE("what was written is read again, and what is no state stays as it was", "[unit][image]") {
  const Model model;
  Holder holder;
  holder.fill();
  const std::vector<std::uint8_t> bytes = image_of(holder);
  Holder other(model);
  REQUIRE_FALSE(read_image(std::span<const std::uint8_t>(bytes), other));
  CHECK(image_of(other) == bytes);
  CHECK(other.count() == 9);
  CHECK(other.model() == &model);
  CHECK(other.times_read() == 1);
}

TEST_CASE("an image that is none is refused, and the reason told", "[unit][image]") {
  Holder holder;
  holder.fill();
  const std::vector<std::uint8_t> bytes = image_of(holder);
  const auto problem_of = [](const std::vector<std::uint8_t>& changed) {
    Holder other;
    return read_image(std::span<const std::uint8_t>(changed), other);
  };
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    CHECK(problem_of({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)}) == ImageProblem::too_short);
  }
  std::vector<std::uint8_t> longer = bytes;
  longer.push_back(0);
  CHECK(problem_of(longer) == ImageProblem::too_long);

  const auto with = [&bytes](std::size_t at, std::uint8_t byte) {
    std::vector<std::uint8_t> changed = bytes;
    changed[at] = byte;
    return changed;
  };
  // 8 bytes of count, 8 of the items' number, then the first: 4 of its number, a bool, a word.
  CHECK(problem_of(with(8, 4)) == ImageProblem::no_size);
  CHECK(problem_of(with(15, 1)) == ImageProblem::no_size);
  CHECK(problem_of(with(20, 2)) == ImageProblem::no_bool);
  CHECK(problem_of(with(21, 3)) == ImageProblem::no_word);
  CHECK(problem_of(with(22, 7)) == ImageProblem::no_bool);     // whether there is a span
  CHECK(problem_of(with(31, 2)) == ImageProblem::no_variant);  // after the span's 8 bytes
  for (const ImageProblem problem :
       {ImageProblem::too_short, ImageProblem::too_long, ImageProblem::no_bool, ImageProblem::no_word,
        ImageProblem::no_size, ImageProblem::no_variant, ImageProblem::no_number, ImageProblem::no_state}) {
    CHECK(to_text(problem).size() > 1);
  }
}

TEST_CASE("numbers further from 0 than any can be are refused", "[unit][image]") {
  const auto problem_of = [](const auto& written) {
    std::remove_cvref_t<decltype(written)> other{};
    const std::vector<std::uint8_t> bytes = image_of(written);
    return read_image(std::span<const std::uint8_t>(bytes), other);
  };
  CHECK_FALSE(problem_of(std::int32_t{1 << 30}));
  CHECK_FALSE(problem_of(std::int32_t{-(1 << 30)}));
  CHECK(problem_of(std::int32_t{(1 << 30) + 1}) == ImageProblem::no_number);
  CHECK(problem_of(std::numeric_limits<std::int32_t>::min()) == ImageProblem::no_number);
  CHECK_FALSE(problem_of(std::int64_t{1} << 52));
  CHECK(problem_of((std::int64_t{1} << 52) + 1) == ImageProblem::no_number);
  CHECK(problem_of(std::numeric_limits<std::int64_t>::min()) == ImageProblem::no_number);
  CHECK_FALSE(problem_of(std::numeric_limits<std::uint64_t>::max()));
  CHECK_FALSE(problem_of(TimePoint{Duration{std::int64_t{1} << 60}}));
  CHECK(problem_of(TimePoint::max()) == ImageProblem::no_number);
  CHECK_FALSE(problem_of(Duration{-(std::int64_t{1} << 62)}));
  CHECK(problem_of(Duration::min()) == ImageProblem::no_number);
  CHECK_FALSE(problem_of(-1e15));
  CHECK_FALSE(problem_of(std::numeric_limits<double>::quiet_NaN()));
  CHECK(problem_of(1.1e15) == ImageProblem::no_number);
  CHECK(problem_of(-std::numeric_limits<double>::infinity()) == ImageProblem::no_number);
}

TEST_CASE("a thing says itself what it cannot be", "[unit][image]") {
  std::vector<std::uint8_t> bytes = image_of(Ring{});
  Ring ring;
  for (std::uint8_t next = 0; next < 5; ++next) {
    bytes[12] = next;
    const auto problem = read_image(std::span<const std::uint8_t>(bytes), ring);
    CHECK(problem == (next < 3 ? std::nullopt : std::optional(ImageProblem::no_state)));
  }
  // Also inside another object, and before a member that is not read any more.
  struct Two {
    Ring first;
    Ring second;
  };
  bytes = image_of(Two{});
  bytes[12] = 3;
  Two two;
  CHECK(read_image(std::span<const std::uint8_t>(bytes), two) == ImageProblem::no_state);
}

TEST_CASE("items that are as many as before keep what is no state", "[unit][image]") {
  FixedVector<Given, 4> items;
  items.push_back({.number = 1, .from_configuration = 100});
  items.push_back({.number = 2, .from_configuration = 200});
  std::vector<std::uint8_t> bytes = image_of(items);
  bytes[8] = 7;
  REQUIRE_FALSE(read_image(std::span<const std::uint8_t>(bytes), items));
  CHECK(items[0].number == 7);
  CHECK(items[1].number == 2);
  CHECK(items[1].from_configuration == 200);
  FixedVector<Given, 4> none;
  REQUIRE_FALSE(read_image(std::span<const std::uint8_t>(bytes), none));
  REQUIRE(none.size() == 2);
  CHECK(none[1].number == 2);
  CHECK(none[1].from_configuration == 0);
}

TEST_CASE("another order, kind or number of members is another layout", "[unit][image]") {
  struct Same {
    std::int32_t other_name = 0;
    bool b = false;
    Word word = Word::none;
  };
  struct Swapped {
    bool b = false;
    std::int32_t number = 0;
    Word word = Word::none;
  };
  struct Wider {
    std::int64_t number = 0;
    bool b = false;
    Word word = Word::none;
  };
  struct OtherWord {
    std::int32_t number = 0;
    bool b = false;
    SignedWord word = SignedWord::low;
  };
  CHECK(image_layout<Plain> == image_layout<Same>);
  CHECK(image_layout<Plain> != image_layout<Swapped>);
  CHECK(image_layout<Plain> != image_layout<Wider>);
  CHECK(image_layout<Plain> != image_layout<OtherWord>);
  CHECK(image_layout<std::array<Plain, 2>> != image_layout<std::array<Plain, 3>>);
  CHECK(image_layout<std::optional<Plain>> != image_layout<Plain>);
}
