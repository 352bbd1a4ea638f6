#include "mmu/scenario/scenario.hpp"

#include <algorithm>
#include <array>

#include "mmu/scenario/scenario_plan.hpp"
#include "mmu/scenario/scenario_words.hpp"

namespace bmu {

using namespace scenario_text;

// --- one line -------------------------------------------------------------------------------------------------------

namespace {

constexpr std::uint32_t repeat_count_max = 10'000;
constexpr std::size_t repeat_depth_max = 4;

using VerbParser = Problem (*)(Words&, const MasterVocabulary&, ScenarioLine&);

struct VerbRow {
  std::string_view word;
  ScenarioVerb verb;
  VerbParser parse;  // reads the text after the word
};

/// `is_needed`: a missing limit is an error; otherwise the limit stays 0.
Problem parse_limit(Words& words, std::string_view name, bool is_needed, ScenarioLine& line) {
  const Word word = words.peek();
  if (word.text != name) return is_needed ? Problem(problem_at(word, std::string(name) + " SECONDS")) : std::nullopt;
  words.take();
  return parse_seconds(words, line.limit);
}

Problem parse_wait(Words& words, const MasterVocabulary& master, ScenarioLine& line) {
  if (Problem problem = parse_condition_words(words, master, line.condition)) return problem;
  return parse_limit(words, "within", true, line);
}

Problem parse_never(Words& words, const MasterVocabulary& master, ScenarioLine& line) {
  if (Problem problem = parse_condition_words(words, master, line.condition)) return problem;
  return parse_limit(words, "for", false, line);
}

/// A frame is momentary: only wait and never can refer to it.
Problem parse_lasting(Words& words, const MasterVocabulary& master, ScenarioLine& line) {
  if (words.peek().text == "frame") return problem_at(words.peek(), "a state; frames are for wait and never");
  return parse_condition_words(words, master, line.condition);
}

Problem parse_always(Words& words, const MasterVocabulary& master, ScenarioLine& line) {
  if (Problem problem = parse_lasting(words, master, line)) return problem;
  return parse_limit(words, "for", false, line);
}

Problem parse_nothing(Words& /*words*/, const MasterVocabulary& /*master*/, ScenarioLine& /*line*/) {
  return std::nullopt;
}

Problem parse_fail(Words& words, const MasterVocabulary& /*master*/, ScenarioLine& line) {
  if (words.at_end()) return std::nullopt;
  const Word word = words.take();
  const bool is_quoted = word.text.size() >= 2 && word.text.front() == '"' && word.text.back() == '"';
  if (!is_quoted) return problem_at(word, "a text in double quotes");
  line.text = word.text.substr(1, word.text.size() - 2);
  return std::nullopt;
}

Problem parse_repeat(Words& words, const MasterVocabulary& /*master*/, ScenarioLine& line) {
  const Word word = words.take();
  const auto count = count_of(word.text, repeat_count_max);
  if (!count) return problem_at(word, "how often: 1 to " + std::to_string(repeat_count_max));
  line.count = *count;
  if (words.at_end()) return std::nullopt;
  const Word every = words.take();
  if (every.text != "every") return problem_at(every, "every SECONDS, or nothing");
  return parse_seconds(words, line.every);
}

constexpr std::array<VerbRow, 8> verbs{{
    {"wait", ScenarioVerb::wait, parse_wait},
    {"expect", ScenarioVerb::expect, parse_lasting},
    {"always", ScenarioVerb::always, parse_always},
    {"never", ScenarioVerb::never, parse_never},
    {"pass", ScenarioVerb::pass, parse_nothing},
    {"fail", ScenarioVerb::fail, parse_fail},
    {"repeat", ScenarioVerb::repeat, parse_repeat},
    {"end", ScenarioVerb::end, parse_nothing},
}};

const VerbRow* find_verb(std::string_view word) {
  const auto row = std::find_if(verbs.begin(), verbs.end(), [word](const VerbRow& one) { return one.word == word; });
  return row == verbs.end() ? nullptr : &*row;
}

std::string all_verbs() {
  std::string words;
  for (const VerbRow& row : verbs) words += (words.empty() ? "" : ", ") + std::string(row.word);
  return words;
}

Problem parse_random_time(Words& words, ScenarioTime& time) {
  NumberRange range;
  if (Problem problem = parse_range(words.take(), {0.0, time_max_s}, range)) return problem;
  time.from = duration_of(range.from);
  time.to = duration_of(range.to);
  return std::nullopt;
}

Problem parse_time(Words& words, ScenarioTime& time) {
  const Word word = words.peek();
  if (find_verb(word.text) != nullptr) return std::nullopt;
  words.take();
  const bool is_relative = word.text.starts_with('+');
  const std::string_view rest = is_relative ? word.text.substr(1) : word.text;
  time.kind = is_relative ? ScenarioTime::Kind::relative : ScenarioTime::Kind::absolute;
  if (rest == "random") return parse_random_time(words, time);
  const auto seconds = number_of(rest);
  if (!seconds || *seconds < 0.0 || *seconds > time_max_s) {
    return problem_at(word, "a time in seconds, 0 to " + number_text(time_max_s) + ", or one of " + all_verbs());
  }
  time.from = time.to = duration_of(*seconds);
  return std::nullopt;
}

/// `line.verb` is set as soon as it is known, even if the text after it is wrong.
Problem parse_line(Words& words, const MasterVocabulary& master, ScenarioLine& line) {
  if (Problem problem = parse_time(words, line.time)) return problem;
  const Word first = words.peek();
  line.column = first.column;
  if (const VerbRow* row = find_verb(first.text)) {
    words.take();
    line.verb = row->verb;
    if (Problem problem = row->parse(words, master, line)) return problem;
  } else if (Problem problem = parse_event_words(words, master, line.event)) {
    return problem;
  }
  if (line.text.empty()) line.text = words.since(first);
  return expect_end(words);
}

// --- lines and blocks -----------------------------------------------------------------------------------------------

class Reader {
 public:
  explicit Reader(const MasterVocabulary& master) : master_(&master) {}

  void read_line(std::string_view text, std::uint32_t number) {
    Words words(text);
    if (words.at_end()) return;
    const Word first = words.peek();
    ScenarioLine line;
    line.line = number;
    line.column = first.column;
    Problem problem = parse_line(words, *master_, line);
    // A block with an error in its first or last line still is a block; otherwise its other end would be an error as
    // well.
    const bool is_understood = !problem;
    Problem misplaced = place(line, first, is_understood);
    if (!problem) problem = std::move(misplaced);
    if (!problem && line.verb != ScenarioVerb::end) {
      reading_.scenario.lines.push_back(std::move(line));
    } else if (problem) {
      add(std::move(*problem), number);
    }
  }

  ScenarioReading finish() {
    for (const Block& block : blocks_) {
      if (block.is_understood) add({0, block.column, "the end of the script", "end, for this repeat"}, block.line);
    }
    if (reading_.problems.empty()) {
      if (Problem problem = check_length(reading_.scenario)) reading_.problems.push_back(std::move(*problem));
    }
    std::stable_sort(reading_.problems.begin(), reading_.problems.end(),
                     [](const ScenarioProblem& one, const ScenarioProblem& other) { return one.line < other.line; });
    return std::move(reading_);
  }

 private:
  struct Block {
    std::uint32_t line = 0;
    std::uint32_t column = 0;
    std::size_t index = 0;  // of its repeat among the lines
    bool is_understood = false;
    bool has_every = false;
    bool is_empty = true;
  };

  /// Opens and closes blocks; returns a problem if the line is not allowed at its position.
  Problem place(const ScenarioLine& line, const Word& first, bool is_understood) {
    if (line.verb == ScenarioVerb::end) return close(line, first);
    if (!blocks_.empty()) blocks_.back().is_empty = false;
    const bool has_fixed_turns =
        std::any_of(blocks_.begin(), blocks_.end(), [](const Block& block) { return block.has_every; });
    if (line.verb == ScenarioVerb::wait && has_fixed_turns) {
      return ScenarioProblem{0, line.column, "'wait'", "no wait in a repeat with every: its turns do not wait"};
    }
    if (line.verb != ScenarioVerb::repeat) return std::nullopt;
    blocks_.push_back(
        {line.line, line.column, reading_.scenario.lines.size(), is_understood, line.every > Duration::zero(), true});
    if (blocks_.size() <= repeat_depth_max) return std::nullopt;
    blocks_.back().is_understood = false;
    return ScenarioProblem{0, line.column, "'repeat'",
                           "at most " + std::to_string(repeat_depth_max) + " of them inside one another"};
  }

  Problem close(const ScenarioLine& line, const Word& first) {
    if (blocks_.empty()) return problem_at(first, "a repeat before it");
    const Block block = blocks_.back();
    blocks_.pop_back();
    if (block.is_empty) return problem_at(first, "a line to repeat");
    if (line.time.kind != ScenarioTime::Kind::as_before) return problem_at(first, "end without a time");
    if (block.is_understood) {
      reading_.scenario.lines[block.index].partner = reading_.scenario.lines.size();
      reading_.scenario.lines.push_back(line);
    }
    return std::nullopt;
  }

  void add(ScenarioProblem problem, std::uint32_t line) {
    problem.line = line;
    reading_.problems.push_back(std::move(problem));
  }

  const MasterVocabulary* master_;
  ScenarioReading reading_;
  std::vector<Block> blocks_;
};

}  // namespace

namespace {

/// Some editors put it before the text.
constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";

}  // namespace

ScenarioReading read_scenario(std::string_view text, const MasterVocabulary& master) {
  Reader reader(master);
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
  for (std::uint32_t number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    reader.read_line(text.substr(0, end), number);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return reader.finish();
}

Result<Scenario, ScenarioProblems> parse_scenario(std::string_view text, const MasterVocabulary& master) {
  ScenarioReading reading = read_scenario(text, master);
  if (!reading.problems.empty()) return failure(std::move(reading.problems));
  return std::move(reading.scenario);
}

Result<ScenarioEvent, ScenarioProblem> parse_event(std::string_view text, const MasterVocabulary& master) {
  Words words(text);
  ScenarioEvent event;
  Problem problem = parse_event_words(words, master, event);
  if (!problem) problem = expect_end(words);
  if (!problem) return event;
  problem->line = 1;
  return failure(std::move(*problem));
}

bool Scenario::is_test() const {
  const auto can_judge = [](const ScenarioLine& line) {
    return line.verb != ScenarioVerb::event && line.verb != ScenarioVerb::repeat && line.verb != ScenarioVerb::end;
  };
  return std::any_of(lines.begin(), lines.end(), can_judge);
}

std::string to_text(const ScenarioProblem& problem, std::string_view file_name) {
  return std::string(file_name) + ":" + std::to_string(problem.line) + ":" + std::to_string(problem.column) +
         ": found " + problem.found + ", expected " + problem.wanted;
}

}  // namespace bmu
