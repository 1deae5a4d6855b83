from __future__ import annotations

import pytest

from rcilab.core.errors import ConnectionLostError, InvalidValueError
from rcilab.makers.rokae.driver.address import SPARE_LOOPBACK, choose_route, parse_address


@pytest.mark.parametrize(
    "text", ["rci://127.0.0.2:1337", "rci://127.0.0.2", "127.0.0.2", " 127.0.0.2:1337 ", "RCI://127.0.0.2:1337/"]
)
def test_everything_but_the_host_may_be_left_out(text):
    address = parse_address(text)
    assert str(address) == "rci://127.0.0.2:1337"
    assert (address.command_port, address.state_port) == (1337, 1337)


def test_options_name_the_ports_that_differ():
    address = parse_address("rci://robot:4000?udp_port=4001&client_port=4002")
    assert (address.host, address.port, address.command_port, address.state_port) == ("robot", 4000, 4001, 4002)
    assert parse_address(str(address)) == address


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("", "write it like rci://"),
        ("http://127.0.0.2", "needs rci://"),
        ("rci://:1337", "needs a host"),
        ("rci://host:99999", "port"),
        ("rci://host:0", "port"),
        ("rci://host/robot", "needs a host"),
        ("rci://host?udp_prt=1", "known: udp_port, client_port"),
        ("rci://host?udp_port=x", "udp_port 'x'"),
        ("rci://[::1]:1337", "IPv6, which is not supported; write the robot's IPv4 address"),
        ("::1", "IPv6"),
        ("foo", "is not a valid address; write it like rci://"),
        ("999.1.1.1", "'999.1.1.1': an IPv4 address has four numbers from 0 to 255"),
        ("rci://192.168.0:1337", "four numbers from 0 to 255"),
        ("rci://1.2.3.4.5", "four numbers from 0 to 255"),
        ("rci://0.0.0.0", "not the address of one machine"),
        ("224.0.0.1", "not the address of one machine"),
        ("rci://a b.c", "'a b.c', which is not a valid name or IPv4 address"),
        ("rci://robot..lab", "not a valid name or IPv4 address"),
    ],
)
def test_a_wrong_address_says_what_is_wrong_with_it(text, hint):
    with pytest.raises(InvalidValueError, match=hint.replace("?", r"\?")):
        parse_address(text)


def test_a_robot_at_another_loopback_address_gets_our_usual_one():
    route = choose_route(parse_address("rci://127.0.0.2:4000"))
    assert route.local_udp == ("127.0.0.1", 4000)
    assert route.local_tcp == ("127.0.0.1", 0)
    assert route.robot_udp == ("127.0.0.2", 4000)


def test_a_robot_at_our_own_address_moves_us_to_a_spare_one():
    assert choose_route(parse_address("rci://127.0.0.1:4000")).local_udp == (SPARE_LOOPBACK, 4000)


def test_different_ports_need_no_spare_address():
    assert choose_route(parse_address("rci://127.0.0.1:4000?udp_port=4001")).local_udp == ("127.0.0.1", 4000)


def test_an_unknown_host_is_named():
    with pytest.raises(ConnectionLostError, match=r"'no-such-robot\.invalid' is not known"):
        choose_route(parse_address("rci://no-such-robot.invalid"))
