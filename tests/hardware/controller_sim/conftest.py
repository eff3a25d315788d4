"""Connections to the simulated controller, byte by byte."""

import socket
import time

import pytest


@pytest.fixture
def wait_until():
    """Waits for a condition, patient on a busy machine."""

    def wait(condition, timeout_s=20.0):
        deadline = time.monotonic() + timeout_s
        while not condition():
            assert time.monotonic() < deadline, "it did not happen in time"
            time.sleep(0.005)

    return wait


@pytest.fixture
def dial(controller):
    """Opens sockets to ports of the controller and closes them at the end."""
    opened = []

    def connect(port, data=b""):
        client = socket.create_connection((controller.host, port), timeout=20.0)
        opened.append(client)
        client.sendall(data)
        return client

    yield connect
    for client in opened:
        client.close()


@pytest.fixture
def is_alive(dial):
    """Whether the dashboard still answers."""

    def ask():
        client = dial(29999, b"robotmode\n").makefile()
        client.readline()
        return client.readline() == "Robotmode: RUNNING\n"

    return ask
