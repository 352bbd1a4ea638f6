// bmudump: shows frames as candump does, and says what they mean on the battery's buses.
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "protocol/dbc.hpp"
#include "tools/bmudump/dump.hpp"
#include "tools/bmudump/protocol_doc.hpp"

namespace {

using namespace bmu::dump;

int print_all(const std::string& text) {
  const bool is_written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0;
  if (is_written || errno == EPIPE) return exit_ok;
  std::fprintf(stderr, "bmudump: cannot write: %s\n", std::strerror(errno));
  return exit_system;
}

/// False, with a word on standard error, if there is one that is no filter in any dialect.
bool add_words(const std::vector<std::string>& words, const std::string& where, const Catalogues& catalogues,
               Filter& filter) {
  for (const std::string& word : words) {
    bool is_known = false;
    for (std::size_t reader = 0; reader < catalogues.size(); ++reader) {
      is_known = filter.add(word, catalogues.at(reader).all()) || is_known;
    }
    if (is_known) continue;
    std::fprintf(stderr,
                 "bmudump: %s: '%s' is no identifier, message, ID:MASK, ID~MASK or #MASK; bmudump --protocol-doc lists "
                 "the messages\n",
                 where.c_str(), word.c_str());
    return false;
  }
  return true;
}

/// The file that is read and is this one, too, by whatever name; "" if there is none.
std::string also_read(int fd, const std::vector<std::string>& files) {
  struct stat written {};
  if (::fstat(fd, &written) != 0 || !S_ISREG(written.st_mode)) return "";
  for (const std::string& file : files) {
    struct stat read {};
    const bool is_there = (file == "-" ? ::fstat(STDIN_FILENO, &read) : ::stat(file.c_str(), &read)) == 0;
    if (is_there && read.st_dev == written.st_dev && read.st_ino == written.st_ino) return file;
  }
  return "";
}

/// Standard output, or the file of -f or -l; below 0 if that cannot be written. One that is read, too, stays as it is.
int open_output(const Options& options) {
  if (options.log_file.empty()) return STDOUT_FILENO;
  const int fd = ::open(options.log_file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
  if (fd < 0) {
    std::fprintf(stderr, "bmudump: cannot write %s: %s\n", options.log_file.c_str(), std::strerror(errno));
    return fd;
  }
  const std::string read = also_read(fd, options.files);
  if (!read.empty()) {
    std::fprintf(stderr, "bmudump: cannot write %s: it is what is read as %s; name another file\n",
                 options.log_file.c_str(), read.c_str());
    ::close(fd);
    return -1;
  }
  // A pipe or a device has no length.
  if (::ftruncate(fd, 0) != 0 && errno != EINVAL) {
    std::fprintf(stderr, "bmudump: cannot write %s: %s\n", options.log_file.c_str(), std::strerror(errno));
    ::close(fd);
    return -1;
  }
  std::fprintf(stderr, "bmudump: writing %s\n", options.log_file.c_str());
  return fd;
}

int show(const Options& options, const Catalogues& catalogues) {
  Filter filter;
  if (!add_words(options.filter, "--filter", catalogues, filter)) return exit_usage;
  std::vector<BusChoice> choices;
  for (const BusWord& word : options.buses) {
    choices.push_back({.name = word.name, .filter = {}});
    if (!add_words(word.filter, word.name, catalogues, choices.back().filter)) return exit_usage;
  }
  const int fd = open_output(options);
  if (fd < 0) return exit_system;
  catch_stop_signals();
  Dump dump(options, catalogues, filter, choices, fd);
  return dump.finish(options.files.empty() ? dump_live(options, dump) : dump_files(options, dump));
}

int run(const Options& options) {
  const Catalogues catalogues(options.catalogue, dialect_table, options.dialect);
  const DumpCatalogue& first = catalogues.at(catalogues.first());
  if (!first.ids_unique()) {
    std::fputs("bmudump: --vehicle-base: there the vehicle messages would collide with those of the internal bus\n",
               stderr);
    return exit_usage;
  }
  if (options.wants_protocol_doc || !options.dbc.empty()) catch_stop_signals();
  if (options.wants_protocol_doc) return print_all(protocol_doc(first));
  if (options.dbc.empty()) return show(options, catalogues);
  return print_all(bmu::dbc_text(options.dbc == "internal" ? first.internal() : first.vehicle(), options.nodes));
}

}  // namespace

int main(int argc, char** argv) {
  const ParsedOptions parsed = parse_options(argc, argv);
  return parsed.options ? run(*parsed.options) : parsed.exit_code;
}
