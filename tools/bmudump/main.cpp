// bmudump: shows frames as candump does, and decodes them with the messages of the battery's buses.
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
#include "tools/bmudump/log_bus.hpp"
#include "tools/bmudump/protocol_doc.hpp"

namespace {

using namespace bmu::dump;

int print_all(const std::string& text) {
  const bool is_written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0;
  if (is_written || errno == EPIPE) return exit_ok;
  std::fprintf(stderr, "bmudump: cannot write: %s\n", std::strerror(errno));
  return exit_system;
}

/// False, with a message on standard error, if a word is no filter in any dialect.
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

/// The input file that is identical to this one, under any name; "" if there is none.
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

/// Standard output, or the file of -f or -l; below 0 if that cannot be written. An input file is never overwritten.
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

/// The probable bus of the device: the bus that is shown, or one of the log, or a placeholder.
std::string likely_bus(const Options& options, const bmu::Device& device) {
  const bool is_named = !options.buses.empty() && options.buses.front().name != every_bus;
  const std::string bus = is_named ? options.buses.front().name : bus_of_logs(options.files, device);
  return bus.empty() ? "BUS" : bus;
}

/// Reports that two senders in the same catalogue have an identifier in common, with the remedy.
void tell_clash(const DumpCatalogue::Clash& clash, const std::string& bus, const Options& options) {
  if (clash.device == nullptr) {
    std::fputs("bmudump: --vehicle-base: there the vehicle messages would collide with those of the internal bus\n",
               stderr);
    return;
  }
  const std::string name(clash.device->name);
  const std::string where = bus.empty() ? "" : " on " + bus;
  const std::string remedy =
      bus.empty() ? "name its bus, and what else is read there: --device " +
                        working_words(likely_bus(options, *clash.device), *clash.device, options.catalogue)
                  : "leave one of them out, or give it another bus";
  std::fprintf(stderr, "bmudump: --device: %s and %s both have identifier %0*X%s; %s\n", name.c_str(),
               clash.other.c_str(), clash.is_extended ? 8 : 3, static_cast<unsigned>(clash.id), where.c_str(),
               remedy.c_str());
}

[[nodiscard]] bool has_clash(const Options& options, const Catalogues& catalogues) {
  const auto first = catalogues.at(catalogues.first()).clash();
  if (first) tell_clash(*first, "", options);
  bool is_found = first.has_value();
  for (const DeviceBus& bus : catalogues.device_buses()) {
    const auto clash = bus.catalogue->clash();
    if (clash) tell_clash(*clash, bus.name, options);
    is_found = is_found || clash.has_value();
  }
  return is_found;
}

std::string dbc_of(const Options& options, const DumpCatalogue& own) {
  if (options.dbc == "internal") return bmu::dbc_text(own.internal(), options.nodes);
  if (options.dbc == "vehicle") return bmu::dbc_text(own.vehicle(), options.nodes);
  const DumpCatalogue devices({.sensor_little_endian = options.catalogue.sensor_little_endian,
                               .has_internal = false,
                               .has_vehicle = false,
                               .devices = devices_of_dbc(options.dbc),
                               .name = options.dbc});
  return bmu::dbc_text(devices.all(), options.nodes);
}

/// Output that needs no bus: no senders are decoded together, so that common identifiers do not matter.
int print_tables(const Options& options) {
  catch_stop_signals();
  if (options.wants_devices) return print_all(device_page());
  DumpCatalogue::Choice choice = options.catalogue;
  choice.devices.clear();
  const Catalogues catalogues(choice, dialect_table, options.dialect);
  const DumpCatalogue& own = catalogues.at(catalogues.first());
  if (!options.wants_protocol_doc) return print_all(dbc_of(options, own));
  return print_all(options.devices.empty() ? protocol_doc(own)
                                           : device_doc(options.devices, own, choice.sensor_little_endian));
}

int run(const Options& options) {
  if (options.wants_protocol_doc || options.wants_devices || !options.dbc.empty()) return print_tables(options);
  const Catalogues catalogues(options.catalogue, dialect_table, options.dialect, options.devices);
  return has_clash(options, catalogues) ? exit_usage : show(options, catalogues);
}

}  // namespace

int main(int argc, char** argv) {
  const ParsedOptions parsed = parse_options(argc, argv);
  return parsed.options ? run(*parsed.options) : parsed.exit_code;
}
