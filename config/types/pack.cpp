#include "config/types/pack.hpp"

namespace bmu {

const std::string& BusNames::name(Port port) const {
  switch (port) {
    case Port::internal: return internal;
    case Port::vehicle: return vehicle;
    case Port::charger: return charger.empty() ? vehicle : charger;
    case Port::second_pack: return second_pack.empty() ? vehicle : second_pack;
    case Port::inverter: break;
  }
  return inverter.empty() ? vehicle : inverter;
}

BusNames BusNames::with(const BusNames& given) const {
  BusNames names = *this;
  const auto take = [&](std::string BusNames::*bus) {
    std::string& name = names.*bus;
    if (!(given.*bus).empty()) {
      name = given.*bus;
    } else if (name == internal) {
      name = names.internal;
    } else if (name == vehicle) {
      name = names.vehicle;
    }
  };
  // Internal and vehicle first: the others may take their names.
  for (const auto bus :
       {&BusNames::internal, &BusNames::vehicle, &BusNames::charger, &BusNames::second_pack, &BusNames::inverter}) {
    take(bus);
  }
  return names;
}

}  // namespace bmu
