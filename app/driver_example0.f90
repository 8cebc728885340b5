!> Example 0 of the paper: a free rigid body, one step of size h, attitude a matrix, by `frb_step`.
!> writes records of m(3), Q(9), t at the start and at the end.
program driver_example0
    use frb, only: wp, frb_step, status_ok, status_message
    use frb_driver_command, only: begin_run, fail, fail_run
    use frb_driver_watch, only: run_watch
    use frb_init_files, only: init_values
    use frb_out_files, only: out_file
    implicit none
    type(init_values) :: start
    type(out_file) :: out
    type(run_watch) :: watch
    character(:), allocatable :: error
    real(wp) :: m(3), attitude(3, 3)
    integer :: i, stat

    call begin_run(0, start, out)
    m = start%m
    attitude = start%attitude
    call watch%begin(start%steps)
    call record(0)
    do i = 1, start%steps
        call watch%begin_step()
        call frb_step(m, attitude, start%h, start%moments, m, attitude, stat=stat)
        call watch%end_step()
        if (stat /= status_ok) call fail_run(out, 'frb_step: '//status_message(stat))
        call record(i)
    end do
    call out%commit(error)
    if (allocated(error)) call fail(error)
    call watch%report('driver_example0: free rigid body, matrix', start%h, out)

contains

    !> Notes and writes the state after step i.
    subroutine record(i)
        integer, intent(in) :: i

        call watch%note(m, attitude, start%moments)
        call out%write_record([m, reshape(attitude, [9]), (real(i, wp)/start%steps)*start%t_final], error)
        if (allocated(error)) call fail_run(out, error)
    end subroutine record

end program driver_example0
