# The two kinds of CAN bus. Included by daemon/shell, and enough on its own for tools and tests that need a bus but no
# daemon.
add_library(bmud_ports STATIC
  ${CMAKE_CURRENT_LIST_DIR}/can/bus_port.cpp
  ${CMAKE_CURRENT_LIST_DIR}/can/can_socket.cpp
  ${CMAKE_CURRENT_LIST_DIR}/can/embedded_bus.cpp
  ${CMAKE_CURRENT_LIST_DIR}/can/embedded_ring.cpp
  ${CMAKE_CURRENT_LIST_DIR}/can/link_details.cpp)
target_link_libraries(bmud_ports PUBLIC bmud_flags Threads::Threads PRIVATE PkgConfig::MNL)
