!> A million free bodies, each of its own shape, over the ranks of MPI: nothing is exchanged but the sums.
program free_bodies
    use frb, only: wp, rigid_body, free_flow, kinetic_energy, spatial_momentum
    use mpi, only: mpi_comm_world, mpi_double_precision, mpi_sum, mpi_allreduce, mpi_comm_rank, &
        mpi_comm_size, mpi_finalize, mpi_init
    implicit none
    integer, parameter :: all_bodies = 1000000, steps = 20
    type(rigid_body), allocatable :: body(:)
    real(wp), allocatable :: m(:, :), q(:, :)
    real(wp) :: before(4), after(4)
    integer :: i, k, n, first, rank, ranks, code

    call mpi_init(code)
    call mpi_comm_rank(mpi_comm_world, rank, code)
    call mpi_comm_size(mpi_comm_world, ranks, code)
    first = int(rank*(all_bodies/real(ranks, wp)))
    n = int((rank + 1)*(all_bodies/real(ranks, wp))) - first
    if (rank == ranks - 1) n = all_bodies - first
    allocate (body(n), m(3, n), q(4, n))
    do k = 1, n
        i = first + k
        body(k) = rigid_body([1.0_wp, 1.2_wp + 0.3_wp*sin(1.0_wp*i), 1.9_wp + 0.3_wp*cos(2.0_wp*i)])
        m(:, k) = [sin(3.0_wp*i), cos(5.0_wp*i), sin(7.0_wp*i)]
        q(:, k) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    end do
    call sums(before)
    do i = 1, steps
        call free_flow(body, 0.1_wp, m, q)
    end do
    call sums(after)
    if (rank == 0) then
        print '(a)', 'a million bodies     energy      sum of Q m'
        print '(a,f16.6,3f14.8)', 'at the start  ', before
        print '(a,i0,a,f16.6,3f14.8)', 'after ', steps, ' steps', after
    end if
    call mpi_finalize(code)

contains

    !> Energy and angular momentum in space of all bodies on all ranks.
    subroutine sums(total)
        real(wp), intent(out) :: total(4)
        real(wp) :: own(4)

        own(1) = kinetic_energy(body, m)
        own(2:4) = spatial_momentum(m, q)
        call mpi_allreduce(own, total, 4, mpi_double_precision, mpi_sum, mpi_comm_world, code)
    end subroutine sums

end program free_bodies

! Output:
!   a million bodies     energy      sum of Q m
!   at the start     598415.426844   -0.42072777    0.04596093    2.10847920
!   after 20 steps   598415.426844   -0.42072777    0.04596093    2.10847920
