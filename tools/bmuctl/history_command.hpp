// bmuctl history: rows and events of the pack, read from the database itself; the daemon need not run.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace bmu {

/// Options of the command line that apply to all commands.
struct HistoryCommandContext {
  std::string socket;  // of a daemon that may report the path of its database
  bool json = false;
  bool with_colour = false;
};

class HistoryCommand {
 public:
  void add_to(CLI::App& app);
  [[nodiscard]] bool is_given() const { return command_ != nullptr && command_->parsed(); }
  /// Returns the exit code.
  [[nodiscard]] int run(const HistoryCommandContext& context) const;

 private:
  CLI::App* command_ = nullptr;
  std::string file_;
  std::string from_;
  std::string to_;
  std::string cells_;
  bool csv_ = false;
  bool events_ = false;
};

}  // namespace bmu
