// bmuctl history: what the pack did, from the database itself; the daemon need not run.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace bmu {

/// What the command line has for all commands.
struct HistoryCommandContext {
  std::string socket;  // of a daemon that may know where the database is
  bool json = false;
  bool with_colour = false;
};

class HistoryCommand {
 public:
  void add_to(CLI::App& app);
  [[nodiscard]] bool is_given() const { return command_ != nullptr && command_->parsed(); }
  /// The exit code.
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
