"""A controller with two TCP channels, such as arm and gripper, whose clients both receive datagrams."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from rcilab.core.clock import SystemClock
from rcilab.core.errors import UsageError
from rcilab.sim.api import NetworkFaults
from rcilab.sim.arrivals import Arrival, ClientConnected, DatagramArrived, UnknownSenderDetected
from rcilab.sim.channels import Peer, TcpChannel, UdpChannel
from rcilab.sim.endpoint import Endpoint
from rcilab.sim.faulty_network import FaultyNetwork

PATIENCE = 10.0  # [s]
ARM = TcpChannel(protocol="arm", port=0)
GRIPPER = TcpChannel(name="gripper_port", protocol="gripper", port=0)


@pytest.fixture
def endpoint() -> Iterator[Endpoint]:
    endpoint = Endpoint("127.0.0.2", [ARM, GRIPPER, UdpChannel(target_port=0)])
    yield endpoint
    endpoint.close()


class Client:
    """A client of one channel, with a UDP port."""

    def __init__(self, endpoint: Endpoint, channel: TcpChannel) -> None:
        port = endpoint.port
        if channel is GRIPPER:
            port = int(endpoint.options.partition("gripper_port=")[2].partition("&")[0])
        self.tcp = socket.create_connection((endpoint.host, port), timeout=PATIENCE)
        self.udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.udp.bind(("127.0.0.1", 0))
        self.udp.settimeout(PATIENCE)
        self.port: int = self.udp.getsockname()[1]
        (arrival,) = poll(endpoint)
        assert isinstance(arrival, ClientConnected)
        self.peer: Peer = arrival.peer

    def close(self) -> None:
        self.tcp.close()
        self.udp.close()


def poll(endpoint: Endpoint) -> list[Arrival]:
    return endpoint.poll(PATIENCE)


@pytest.fixture
def arm(endpoint: Endpoint) -> Iterator[Client]:
    client = Client(endpoint, ARM)
    yield client
    client.close()


@pytest.fixture
def gripper(endpoint: Endpoint, arm: Client) -> Iterator[Client]:
    client = Client(endpoint, GRIPPER)
    yield client
    client.close()


def test_each_client_receives_the_datagrams_for_it(endpoint: Endpoint, arm: Client, gripper: Client) -> None:
    assert endpoint.direct_datagrams(arm.peer, arm.port)
    assert endpoint.direct_datagrams(gripper.peer, gripper.port)
    endpoint.send_datagram(b"arm")
    endpoint.send_datagram(b"gripper", gripper.peer)
    endpoint.send_datagram(b"arm again")
    assert [arm.udp.recv(100), arm.udp.recv(100)] == [b"arm", b"arm again"]
    assert gripper.udp.recv(100) == b"gripper"


def test_only_the_client_of_the_arm_commands(endpoint: Endpoint, arm: Client, gripper: Client) -> None:
    endpoint.direct_datagrams(arm.peer, arm.port)
    endpoint.direct_datagrams(gripper.peer, gripper.port)
    endpoint.send_datagram(b"state")
    _, controller = arm.udp.recvfrom(100)
    arm.udp.sendto(b"command", controller)
    assert poll(endpoint) == [DatagramArrived(b"command")]
    gripper.udp.sendto(b"noise", controller)
    for _ in range(100):
        arrivals = endpoint.poll(0.1)
        if arrivals:
            break
    assert arrivals == [UnknownSenderDetected(f"127.0.0.1:{gripper.port}", "127.0.0.1")]
    assert endpoint.unknown_senders == 1


def test_a_gripper_without_an_arm_receives_its_own(endpoint: Endpoint) -> None:
    gripper = Client(endpoint, GRIPPER)
    endpoint.send_datagram(b"lost", gripper.peer)  # It has not named a port.
    assert not endpoint.direct_datagrams(gripper.peer, 80)
    assert endpoint.direct_datagrams(gripper.peer, gripper.port)
    endpoint.send_datagram(b"for the arm")
    endpoint.send_datagram(b"gripper", gripper.peer)
    assert gripper.udp.recv(100) == b"gripper"
    gripper.close()


def test_the_end_of_one_client_leaves_the_other(endpoint: Endpoint, arm: Client, gripper: Client) -> None:
    endpoint.direct_datagrams(arm.peer, arm.port)
    endpoint.direct_datagrams(gripper.peer, gripper.port)
    endpoint.drop(gripper.peer, "test")
    endpoint.send_datagram(b"nobody", gripper.peer)
    endpoint.send_datagram(b"arm")
    assert arm.udp.recv(100) == b"arm"
    assert not endpoint.direct_datagrams(gripper.peer, gripper.port)


def test_network_faults_do_not_reach_the_gripper(endpoint: Endpoint, arm: Client, gripper: Client) -> None:
    network = FaultyNetwork(endpoint, SystemClock(), NetworkFaults(), NetworkFaults(loss=1.0))
    network.direct_datagrams(arm.peer, arm.port)
    network.direct_datagrams(gripper.peer, gripper.port)
    network.send_datagram(b"state")
    network.send_datagram(b"gripper", gripper.peer)
    assert gripper.udp.recv(100) == b"gripper"
    arm.udp.setblocking(False)
    with pytest.raises(BlockingIOError):
        arm.udp.recv(100)


@pytest.fixture
def denied(monkeypatch: pytest.MonkeyPatch) -> None:
    """Port 502 needs privileges that this user has not."""
    bind = socket.socket.bind

    def refuse(sock: socket.socket, address: tuple[str, int] | str) -> None:
        if address == ("127.0.0.3", 502):
            raise PermissionError(13, "Permission denied")
        bind(sock, address)

    monkeypatch.setattr(socket.socket, "bind", refuse)


def channels(folder: Path) -> tuple[TcpChannel, TcpChannel]:
    return (
        TcpChannel(protocol="arm", port=502, socket_path=folder / "arm", max_clients=2),
        TcpChannel(name="report_port", protocol="reports", port=0, socket_path=folder / "reports"),
    )


def test_without_privileges_clients_connect_by_unix_sockets(denied: None, tmp_path: Path) -> None:
    endpoint = Endpoint("127.0.0.3", channels(tmp_path))
    assert (endpoint.host, endpoint.port) == ("127.0.0.3", 502)
    assert "sysctl net.ipv4.ip_unprivileged_port_start=502" in endpoint.warning
    for name in ("arm", "reports", "arm"):
        with socket.socket(socket.AF_UNIX) as client:
            client.connect(str(tmp_path / name))
            arrival = poll(endpoint)[-1]
            assert isinstance(arrival, ClientConnected)
            endpoint.send_frame(arrival.peer, b"hello")
            assert client.recv(100) == b"hello"
            assert arrival.peer.channel.protocol == ("arm" if name == "arm" else "reports")
    endpoint.close()
    assert not list(tmp_path.iterdir())


def test_a_second_controller_without_privileges_names_the_alternatives(denied: None, tmp_path: Path) -> None:
    first = Endpoint("127.0.0.3", channels(tmp_path))
    with pytest.raises(UsageError, match=r"502 needs privileges, and .*arm.* is in use; stop .*, start as root, or"):
        Endpoint("127.0.0.3", channels(tmp_path))
    first.close()


def test_the_file_of_a_killed_controller_is_replaced(denied: None, tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as killed:
        killed.bind(str(tmp_path / "arm"))
    endpoint = Endpoint("127.0.0.3", channels(tmp_path))
    with socket.socket(socket.AF_UNIX) as client:
        client.connect(str(tmp_path / "arm"))
    endpoint.close()


def test_with_a_free_port_no_unix_socket_is_opened(tmp_path: Path) -> None:
    arm, reports = channels(tmp_path)
    endpoint = Endpoint("127.0.0.3", (replace(arm, port=0), reports))
    assert not list(tmp_path.iterdir())
    assert endpoint.warning == ""
    endpoint.close()


def test_a_port_that_needs_privileges_names_two_alternatives(denied: None) -> None:
    with pytest.raises(UsageError, match="above 1023 with --port N, start as root, or allow the port"):
        Endpoint("127.0.0.3", [TcpChannel(protocol="arm", port=502)])


def test_a_port_that_another_listens_on_since_is_one_sentence() -> None:
    endpoint = Endpoint("127.0.0.4", [ARM])
    port = endpoint.port
    endpoint.close()
    with pytest.raises(UsageError, match=rf"TCP port {port} on 127.0.0.4 is in use; stop .* with --port N"):
        Endpoint("127.0.0.4", [replace(ARM, port=port), replace(GRIPPER, port=port)])
    Endpoint("127.0.0.4", [replace(ARM, port=port)]).close()


def test_a_port_on_which_clients_insist_needs_another_address() -> None:
    gripper = replace(GRIPPER, option=None)
    first = Endpoint("127.0.0.4", [gripper])
    with pytest.raises(UsageError, match=r"on which clients insist, is in use; .* another address with --host"):
        Endpoint("127.0.0.4", [ARM, replace(gripper, port=first.port)])
    first.close()
