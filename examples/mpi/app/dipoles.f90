!> The lattice of dipoles of scene 6 over the ranks of MPI: every rank owns and integrates a block of dipoles;
!> a torque first gathers the dipoles of all ranks. All printed digits of the energies are those of one rank.
!>
!> `dipoles fail` makes a torque of the last rank NaN during the run: all ranks end with the same status.
module frb_dipole_ranks
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
    use frb, only: wp, group_scene, quat_rotate, quat_rotate_back, status_ok
    use mpi, only: mpi_comm_world, mpi_double_precision, mpi_integer, mpi_max, mpi_sum, mpi_in_place, &
        mpi_allgatherv, mpi_allreduce
    implicit none
    private

    public :: dipole_ranks, new_lattice

    type, extends(group_scene) :: dipole_ranks
        real(wp), allocatable :: centres(:, :)          ! (3, all), in space
        real(wp), allocatable :: dipoles(:, :)          ! (3, all), gathered anew for each torque
        real(wp), allocatable :: mine(:, :), field(:, :)    ! (3, own)
        integer, allocatable :: counts(:), starts(:)    ! of numbers, three a body, on each rank
        integer :: first = 1                            ! number of the first own body among all bodies
        integer :: calls = 0
        integer :: fails_at = 0                         ! the call whose torque is NaN; 0: none
    contains
        procedure :: torques
        procedure :: potential
        procedure :: agree
    end type dipole_ranks

contains

    !> `side` by `side` dipoles, two apart, in blocks of rows of equal size but for one.
    pure function new_lattice(side, rank, ranks) result(lattice)
        integer, intent(in) :: side, rank, ranks
        type(dipole_ranks) :: lattice
        integer :: n, i, own

        n = side**2
        allocate (lattice%centres(3, n), lattice%dipoles(3, n))
        do i = 1, n
            lattice%centres(:, i) = 2.0_wp*[mod(i - 1, side), (i - 1)/side, 0]
        end do
        lattice%starts = [(3*(n*i/ranks), i=0, ranks - 1)]
        lattice%counts = [(3*(n*(i + 1)/ranks) - 3*(n*i/ranks), i=0, ranks - 1)]
        lattice%first = n*rank/ranks + 1
        own = lattice%counts(rank + 1)/3
        allocate (lattice%mine(3, own), lattice%field(3, own))
    end function new_lattice

    !> The dipoles of all ranks, and the field of all others at the own dipoles, in space.
    subroutine look_around(self, q)
        class(dipole_ranks), intent(inout) :: self
        real(wp), intent(in) :: q(:, :)
        real(wp) :: r(3), e(3), r2
        integer :: i, j, k, code

        do i = 1, size(q, 2)
            self%mine(:, i) = quat_rotate(q(:, i), [0.0_wp, 0.0_wp, 1.0_wp])
        end do
        call mpi_allgatherv(self%mine, size(self%mine), mpi_double_precision, self%dipoles, self%counts, &
                            self%starts, mpi_double_precision, mpi_comm_world, code)
        do i = 1, size(q, 2)
            k = self%first + i - 1
            e = 0.0_wp
            do j = 1, size(self%dipoles, 2)
                if (j == k) cycle
                r = self%centres(:, k) - self%centres(:, j)
                r2 = dot_product(r, r)
                e = e + (3*dot_product(self%dipoles(:, j), r)/r2*r - self%dipoles(:, j))/(r2*sqrt(r2))
            end do
            self%field(:, i) = e
        end do
    end subroutine look_around

    subroutine torques(self, q, t, tau, stat)
        class(dipole_ranks), intent(inout) :: self
        real(wp), contiguous, intent(in) :: q(:, :)
        real(wp), intent(in) :: t
        real(wp), contiguous, intent(out) :: tau(:, :)
        integer, intent(out) :: stat
        integer :: i

        associate (unused_t => t)
        end associate
        call look_around(self, q)
        do i = 1, size(q, 2)
            associate (p => self%mine(:, i), e => self%field(:, i))
                tau(:, i) = quat_rotate_back(q(:, i), [p(2)*e(3) - p(3)*e(2), p(3)*e(1) - p(1)*e(3), &
                                                       p(1)*e(2) - p(2)*e(1)])
            end associate
        end do
        self%calls = self%calls + 1
        if (self%calls == self%fails_at) tau(1, 1) = ieee_value(1.0_wp, ieee_quiet_nan)
        stat = status_ok
    end subroutine torques

    !> The potential of all dipoles, the same on every rank.
    subroutine potential(self, q, t, v, stat)
        class(dipole_ranks), intent(inout) :: self
        real(wp), contiguous, intent(in) :: q(:, :)
        real(wp), intent(in) :: t
        real(wp), intent(out) :: v
        integer, intent(out) :: stat
        integer :: code

        associate (unused_t => t)
        end associate
        call look_around(self, q)
        v = -0.5_wp*sum(self%mine*self%field)
        call mpi_allreduce(mpi_in_place, v, 1, mpi_double_precision, mpi_sum, mpi_comm_world, code)
        stat = status_ok
    end subroutine potential

    !> If one rank refuses, the run ends on all ranks.
    subroutine agree(self, code)
        class(dipole_ranks), intent(inout) :: self
        integer, intent(inout) :: code
        integer :: failed

        associate (unused_self => self)
        end associate
        call mpi_allreduce(mpi_in_place, code, 1, mpi_integer, mpi_max, mpi_comm_world, failed)
    end subroutine agree

end module frb_dipole_ranks

program dipoles
    use frb, only: wp, rigid_body, splitting_scheme, integrate, kinetic_energy, status_ok
    use frb_dipole_ranks, only: dipole_ranks, new_lattice
    use mpi, only: mpi_comm_world, mpi_double_precision, mpi_integer, mpi_sum, mpi_allreduce, mpi_comm_rank, &
        mpi_comm_size, mpi_finalize, mpi_gather, mpi_init
    implicit none
    integer, parameter :: side = 6
    type(dipole_ranks) :: lattice
    type(rigid_body) :: body
    real(wp), allocatable :: m(:, :), q(:, :)
    integer, allocatable :: status_of(:)
    real(wp) :: t, kinetic, potential
    character(8) :: argument
    integer :: i, k, rank, ranks, code, stat

    call mpi_init(code)
    call mpi_comm_rank(mpi_comm_world, rank, code)
    call mpi_comm_size(mpi_comm_world, ranks, code)
    lattice = new_lattice(side, rank, ranks)
    call get_command_argument(1, argument)
    if (argument == 'fail' .and. rank == ranks - 1) lattice%fails_at = 1000
    body = rigid_body([1.0_wp, 1.0_wp, 0.2_wp])
    allocate (m(3, size(lattice%mine, 2)), q(4, size(lattice%mine, 2)), status_of(ranks))
    do k = 1, size(q, 2)
        i = lattice%first + k - 1
        q(:, k) = [cos(1.0_wp*i), sin(2.0_wp*i), cos(3.0_wp*i), sin(5.0_wp*i)]
        q(:, k) = q(:, k)/norm2(q(:, k))
    end do
    m = 0.0_wp
    t = 0.0_wp
    stat = status_ok
    if (rank == 0) print '(a)', '    t    T            T + V'
    do i = 0, 5
        call lattice%potential(q, t, potential, code)
        call mpi_allreduce(kinetic_energy(body, m), kinetic, 1, mpi_double_precision, mpi_sum, &
                           mpi_comm_world, code)
        if (rank == 0) print '(f6.1,f10.4,f16.9)', t, kinetic, kinetic + potential
        if (stat /= status_ok .or. i == 5) exit
        call integrate(body, splitting_scheme('srkn14'), lattice, 0.1_wp, 50, m, q, t=t, stat=stat)
    end do
    call mpi_gather(stat, 1, mpi_integer, status_of, 1, mpi_integer, 0, mpi_comm_world, code)
    if (rank == 0) print '(a,*(1x,i0))', 'status on the ranks:', status_of
    call mpi_finalize(code)
end program dipoles

! Output:
!       t    T            T + V
!      0.0    0.0000    -1.815160953
!      5.0    2.7301    -1.815160953
!     10.0    4.0343    -1.815160953
!     15.0    3.9203    -1.815160953
!     20.0    4.3996    -1.815160953
!     25.0    3.1302    -1.815160953
!   status on the ranks: 0 0
